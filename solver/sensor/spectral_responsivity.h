// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "scene/scene.h"

namespace truebox {

/// The spectrum of the light that a scene's lamps send out, W nm^-1: sum of exitance times area, as
/// finely as their sources tabulate it. Flat where nothing emits.
TabulatedSpectrum luminaire_spectrum(const Scene& scene);

/// Photo-electrons per radiant energy, integrated over each band, nm J^-1: times the band's
/// radiance (W m^-2 sr^-1 nm^-1) and an etendue (m^2 sr) they give electrons a second.
///
///   w_b = width_b  int_b eta(l) l / (h c) M(l) dl / int_b M(l) dl
///
/// eta is the product of `factors` (filters, glass, quantum efficiency; 1) and M the lamp's
/// spectrum in any unit: within a band the radiance has the lamp's shape, so that a line lamp is
/// integrated where its lines are. What a reflectance does within a band is neglected. Where the
/// lamp is dark in a whole band, M is flat there. Exact for piecewise-linear curves. What lies
/// between or outside the bands contributes nothing.
/// Throws std::invalid_argument for a negative lamp or more than 12 factors.
/// Source: EMVA Standard 1288 (2021), 2.2 (electrons of absorbed photons); h, c: SI Brochure
/// (2019).
std::vector<double> band_responsivity(const std::vector<TabulatedSpectrum>& factors,
                                      const WavelengthGrid& bands, const TabulatedSpectrum& lamp);

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "radiometry/observer.h"
#include "scene/scene.h"

namespace truebox {

/// The sum of spectra, on all their wavelengths; empty if there is none.
TabulatedSpectrum sum_of(const std::vector<TabulatedSpectrum>& spectra);

/// What the scene is lit by before anything is reflected: the sum of its materials' tabulated
/// emissions, each square metre of lamp counted alike. Empty where nothing emits, or by temperature
/// only.
TabulatedSpectrum lamp_spectrum(const Scene& scene);

/// Per band weight of X, Y, Z (nm): that of `band_weights`, or following the lamps within each band
/// where their table is finer than the bands.
std::vector<Tristimulus> display_weights(const Scene& scene, const Observer& observer);

}  // namespace truebox

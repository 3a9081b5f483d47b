// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "radiometry/observer.h"

namespace truebox {

/// Few bands that still give the colour of many reflections: what is measured in a band counts as
/// the light of the lamp has it there,
///   f_b = integral_b f S dlambda / integral_b S dlambda,
/// for reflectances and for colour matching functions alike. The flux that one reflection of that
/// lamp's light leaves is then exact whatever the number of bands; a colour, or what several
/// reflections leave, is wrong by how reflectances and matching functions vary together within a
/// band: by the square of its width.

/// `count` bands of one width that fill [from, to]; std::invalid_argument where there are none.
WavelengthGrid equal_bands(double from_nm, double to_nm, std::size_t count);

/// Mean over each band weighted by `lamp`, both taken as lines between their points; the plain mean
/// where the lamp is dark. std::invalid_argument for a lamp that is negative somewhere.
std::vector<double> lamp_weighted_means(const TabulatedSpectrum& spectrum,
                                        const WavelengthGrid& grid, const TabulatedSpectrum& lamp);

/// band_weights for a stimulus that follows `lamp` within each band instead of being even.
std::vector<Tristimulus> lamp_weighted_band_weights(const WavelengthGrid& grid,
                                                    const Observer& observer,
                                                    const TabulatedSpectrum& lamp);

}  // namespace truebox

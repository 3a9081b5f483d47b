// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "radiometry/tabulated_spectrum.h"
#include "radiometry/wavelength_grid.h"

namespace truebox {

/// CIE tristimulus values X, Y, Z, in the unit of the stimulus times nm unless normalised.
struct Tristimulus {
  double X = 0.0, Y = 0.0, Z = 0.0;
};

/// Linear RGB on the ITU-R BT.709 primaries, D65 white; not clamped.
using LinearRgb = std::array<double, 3>;

/// Colour matching functions of one observer.
struct Observer {
  std::string name;  ///< "CIE 1931 2 deg"
  TabulatedSpectrum x_bar, y_bar, z_bar;
};

/// Reads columns x_bar, y_bar, z_bar (or the second to fourth). Throws InputError.
Observer read_observer(const std::filesystem::path& path, std::string name);

/// Tristimulus values of a band-wise stimulus (n values, one a band):
/// X = sum_b S_b integral_band x_bar dlambda. Source: CIE 15:2018, 7.1.
/// Only the bands given contribute: what lies between or outside them is taken as dark.
Tristimulus tristimulus(const std::vector<double>& stimulus, const WavelengthGrid& grid,
                        const Observer& observer);

/// Per band weight of X, Y, Z (nm): the linear map behind `tristimulus`, for many pixels.
std::vector<Tristimulus> band_weights(const WavelengthGrid& grid, const Observer& observer);

/// XYZ (D65) to linear BT.709. Source: ITU-R BT.709-6 primaries, IEC 61966-2-1 matrix.
LinearRgb linear_bt709(const Tristimulus& xyz);

}  // namespace truebox

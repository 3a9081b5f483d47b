// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <vector>

namespace truebox {

/// Weights of the discrete Gaussian, w[0] in the middle, w[n] at n px on both sides:
/// w[n] = exp(-t) I_n(t), t = sigma^2. They sum to one and their variance is sigma^2 exactly, also
/// for a sigma below a pixel, where samples of the continuous bell would not do.
/// 0 <= sigma_px; cut where a weight falls below 1e-17 of the first.
/// Source: Lindeberg (1990), IEEE PAMI 12(3), eq. 24.
std::vector<double> discrete_gaussian(double sigma_px);

/// One plane of the light on a sensor, row by row, any unit per pixel.
struct LightPlane {
  int width = 0, height = 0;
  std::vector<double> values;
};

/// Spreads every pixel's light by a Gaussian of sigma_px = (along x, along y). Light is conserved:
/// what leaves over an edge comes back mirrored, in place of what the picture does not show.
void spread(LightPlane& plane, std::array<double, 2> sigma_px);

/// Spreads `share` of all light evenly: E' = (1 - share) E + share mean(E). A black spot in a
/// uniform field then reads `share` of it, the veiling glare index. Source: ISO 9358:1994, 3.1.
void add_veiling_glare(LightPlane& plane, double share);

}  // namespace truebox

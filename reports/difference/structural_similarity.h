// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "difference/metric_map.h"

namespace truebox {

/// Structural similarity, one value a pixel in [-1, 1], 1 for equal surroundings: mean of the three
/// channels' SSIM. Display-coded (nonlinear) samples in [0, 1]; Gaussian window of 11 x 11 px,
/// sigma 1.5 px, K1 = 0.01, K2 = 0.03; borders are mirrored. The window is OpenCV's.
/// Source: Wang, Bovik, Sheikh, Simoncelli (2004), IEEE Trans. Image Process. 13(4), eq (13).
std::vector<float> structural_similarity(int width, int height, const RgbPlanes& test,
                                         const RgbPlanes& reference);

}  // namespace truebox

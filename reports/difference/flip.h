// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "difference/metric_map.h"

namespace truebox {

/// Pixels a degree of a viewer 0.7 m before a 3840 px wide screen of 0.7 m, the papers' default:
/// 0.7 m * 3840 px / 0.7 m * pi / 180.
inline constexpr double kDefaultPixelsPerDegree = 67.0206432765823;

/// FLIP, in [0, 1]: what a viewer notices who flips between two pictures in place. Linear BT.709
/// as a display shows it, in [0, 1] (values outside are clamped); edges are continued outwards.
/// Source: Andersson, Nilsson, Akenine-Moeller, Oskarsson, Astrom, Fairchild (2020), Proc. ACM
/// Comput. Graph. Interact. Tech. 3(2), eqs (1)-(22).
/// Throws std::invalid_argument unless all planes have width x height samples and ppd > 0.
std::vector<float> flip(int width, int height, const RgbPlanes& test, const RgbPlanes& reference,
                        double pixels_per_degree = kDefaultPixelsPerDegree);

/// The exposures, in stops, at which HDR-FLIP looks at an image.
struct FlipExposures {
  double start = 0.0, stop = 0.0;
  int count = 1;
};

/// From where the brightest pixel of the reference, to where its median, is shown at 0.85 of white:
/// max(2, ceil(stop - start)) exposures. A median of 0 is taken over the lit pixels only; a black
/// reference has one exposure. Source: as below, section 3.2.
FlipExposures flip_exposures(const RgbPlanes& reference);

/// HDR-FLIP, in [0, 1]: the worst FLIP over the exposures, tone mapped with the ACES fit of
/// Narkowicz. Scene-linear BT.709 in any unit; negative values count as none.
/// Source: Andersson, Nilsson, Shirley, Akenine-Moeller (2021), Eurographics short papers.
std::vector<float> hdr_flip(int width, int height, const RgbPlanes& test,
                            const RgbPlanes& reference,
                            double pixels_per_degree = kDefaultPixelsPerDegree);

}  // namespace truebox

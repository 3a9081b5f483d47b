// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "difference/flip.h"
#include "difference/metric_map.h"

namespace truebox {

/// What turns scene-linear light into light of a display, the same for both sides.
struct ViewingConditions {
  double exposure = 1.0;       ///< 1 / (the value shown as white)
  double white_cd_m2 = 203.0;  ///< luminance of the display's white (ITU-R BT.2408)
  double pixels_per_degree = kDefaultPixelsPerDegree;
};

/// Colour differences a viewer would see: maps "ciede2000", "itp", "flip", "hdr-flip" and "dssim"
/// (1 - SSIM). Scene-linear BT.709 (D65), any unit. CIEDE2000 takes the display's white as white;
/// flip and dssim see what the display shows, clamped. A pixel that is not finite on either side is
/// NaN in every map, and counts as black for its neighbours.
std::vector<MetricMap> perceptual_maps(int width, int height, RgbPlanes test, RgbPlanes reference,
                                       const ViewingConditions& viewing);

}  // namespace truebox

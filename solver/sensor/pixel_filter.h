// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

namespace truebox {

/// How a pixel weighs what falls on the film around it. Points are drawn from the weight, so that a
/// pixel is the plain mean of its points.
enum class PixelFilter {
  box,   ///< the pixel's own square, evenly
  tent,  ///< linear to zero one pixel from the centre (bilinear)
};

/// Where a number in (0, 1) lands along one axis, px from the pixel's left or upper edge; the
/// centre is 0.5.
inline double filtered_position_px(PixelFilter filter, double u) {
  if (filter == PixelFilter::box) return u;
  return u < 0.5 ? std::sqrt(2.0 * u) - 0.5 : 1.5 - std::sqrt(2.0 - 2.0 * u);
}

}  // namespace truebox

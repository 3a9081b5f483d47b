// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>

#include "sensor/camera.h"
#include "sensor/pixel_filter.h"
#include "transport/prediction.h"

namespace truebox {

struct RenderOptions {
  int samples = 16;  ///< points of a pixel in which the radiance is even
  /// Of one that an edge, a shadow's edge or a corner crosses; up to 16 times as many while its
  /// sampling bound is above `even_within`.
  int edge_samples = 256;
  double even_within = 2e-2;  ///< sampling bound / radiance up to which a pixel counts as even
  PixelFilter filter = PixelFilter::box;
  /// Pixels whose bound is above this share of their radiance gather their indirect light once
  /// more, by exact visibility (final gather): slow, and better close to edges. Infinite: none
  /// does.
  double gather_above = std::numeric_limits<double>::infinity();
  Progress progress;
};

/// Spectral radiance seen by a camera and what it can be wrong by, both in W m^-2 sr^-1 nm^-1,
/// channels "S0.<nm>nm".
struct RenderedImage {
  Image radiance;
  Image error_bound;
  std::size_t edge_pixels = 0;      ///< those that took `edge_samples`
  std::size_t gathered_pixels = 0;  ///< those that took a final gather
};

/// Radiance of each pixel: mean over low-discrepancy points of L = B / pi of the surface seen,
/// direct light exact at every point, indirect light from the gathered field or a final gather.
/// Backs are black, what leaves the scene is 0. The bound is the prediction's own plus, for the
/// n-point mean, the range of the points times n^-3/4 where an edge crosses the pixel (its rate
/// through a low-discrepancy set; Mitchell 1992) and times n^-1 where the radiance is smooth
/// (Koksma-Hlawka).
RenderedImage render(const Prediction& prediction, const Camera& camera,
                     const RenderOptions& options);

}  // namespace truebox

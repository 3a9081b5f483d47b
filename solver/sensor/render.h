// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "sensor/camera.h"
#include "transport/prediction.h"

namespace truebox {

struct RenderOptions {
  int samples_per_side = 4;        ///< of a pixel that sees one flat surface: n x n points
  int edge_samples_per_side = 16;  ///< of a pixel in which something changes
  Progress progress;
};

/// Spectral radiance seen by a camera and what it can be wrong by, both in W m^-2 sr^-1 nm^-1,
/// channels "S0.<nm>nm"; box pixel filter.
struct RenderedImage {
  Image radiance;
  Image error_bound;
};

/// Radiance of each pixel: mean over low-discrepancy points of L = B / pi of the surface seen,
/// direct light exact at every point, indirect light from the smooth field. Backs are black, what
/// leaves the scene is 0.
/// The bound is the prediction's own plus, for the n-point mean, the range of the points times
/// n^-3/4 where an edge crosses the pixel (its rate through a low-discrepancy set; Mitchell 1992)
/// and times n^-1 where the radiance is smooth (Koksma-Hlawka).
RenderedImage render(const Prediction& prediction, const Camera& camera,
                     const RenderOptions& options);

}  // namespace truebox

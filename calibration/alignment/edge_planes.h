// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "image/image.h"

namespace truebox {

/// A photograph prepared for finding edges, possibly reduced: `reduction` x `reduction` pixels of
/// the file are averaged, which is a box filter again, only larger. Row by row from the top left.
struct EdgePlanes {
  int width = 0, height = 0;
  int reduction = 1;
  /// Proportional to light, one or three planes, largest (99.9 %) 1. In these the middle of a
  /// blurred step is where its edge is; in display values (sRGB) it would be off by up to half the
  /// blur.
  std::vector<std::vector<float>> linear;
  /// Their square roots, in which weak edges in the dark count too: for finding, not measuring.
  std::vector<std::vector<float>> guide;

  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(x);
  }
};

/// Channels R, G, B where there are such (decoded if attribute "transfer" says sRGB), else the mean
/// of all. What is not finite counts as dark. Reduced until no side exceeds `most_px`.
EdgePlanes edge_planes(const Image& photograph, int most_px);

/// A channel in proportion to light: decoded if attribute "transfer" says sRGB. What is not finite
/// counts as dark.
std::vector<float> linear_light(const Image& image, const Channel& channel);

/// The reading at which a picture of whole digital numbers clips (attribute "white_dn"); infinite
/// where there is no such.
double saturation_of(const Image& image);

/// Averages n x n pixels; what is left over at the right and bottom is dropped.
std::vector<float> reduced(const std::vector<float>& plane, int width, int height, int n);

}  // namespace truebox

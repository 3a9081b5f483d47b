// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "fit/chart_fit.h"
#include "readings/photograph.h"

namespace truebox {

/// Pixel to chart coordinates: (x_px - centre) / half_width, so that the chart spans [-1, 1].
struct ChartFrame {
  double centre_x_px = 0.0, centre_y_px = 0.0;
  double half_width_px = 1.0, half_height_px = 1.0;

  double x(double x_px) const { return (x_px - centre_x_px) / half_width_px; }
  double y(double y_px) const { return (y_px - centre_y_px) / half_height_px; }
};

/// The frame that spans the labelled pixels. Labels: width x height, 0 = outside.
ChartFrame chart_frame(const std::vector<std::uint8_t>& labels, int width, int height);

/// Means of the photosites of one colour over squares of block_px pixels that lie at least half
/// inside a patch. u^2 = mean photosite variance + (relative_u value)^2: quantisation errors of
/// neighbouring photosites move together, so that the mean does not average them away; the second
/// term is the patch's texture.
std::vector<PatchBlock> chart_blocks(const Photograph& photograph, char site,
                                     const std::vector<std::uint8_t>& labels, int block_px,
                                     double relative_u, const ChartFrame& frame);

/// One value a 2 x 2 cell, from the photosites of one colour in it: a plane without gaps and
/// without interpolation, (width / 2) x (height / 2).
struct CellPlane {
  int width = 0, height = 0;
  std::vector<float> value, variance;  ///< DN s^-1 and its square; variance infinite if saturated
};
CellPlane cell_plane(const Photograph& photograph, char site);

/// The label of each 2 x 2 cell whose four pixels agree, else 0.
std::vector<std::uint8_t> cell_labels(const std::vector<std::uint8_t>& labels, int width,
                                      int height);

}  // namespace truebox

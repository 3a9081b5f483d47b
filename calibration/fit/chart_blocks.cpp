// SPDX-License-Identifier: BSD-3-Clause
#include "fit/chart_blocks.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

namespace truebox {

ChartFrame chart_frame(const std::vector<std::uint8_t>& labels, int width, int height) {
  int x0 = width, x1 = 0, y0 = height, y1 = 0;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      if (labels[static_cast<std::size_t>(y * width + x)] == 0) continue;
      x0 = std::min(x0, x);
      x1 = std::max(x1, x + 1);
      y0 = std::min(y0, y);
      y1 = std::max(y1, y + 1);
    }
  if (x1 <= x0 || y1 <= y0) return {};
  return {0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.5 * (x1 - x0), 0.5 * (y1 - y0)};
}

std::vector<PatchBlock> chart_blocks(const Photograph& photograph, char site,
                                     const std::vector<std::uint8_t>& labels, int block_px,
                                     double relative_u, const ChartFrame& frame) {
  struct Sums {
    double value = 0.0, variance = 0.0, x = 0.0, y = 0.0;
    int n = 0;
  };
  std::map<std::tuple<int, int, int>, Sums> squares;
  for (int y = 0; y < photograph.height; ++y)
    for (int x = 0; x < photograph.width; ++x) {
      const std::size_t i = photograph.index(x, y);
      if (labels[i] == 0 || photograph.bayer.site(x, y) != site ||
          !std::isfinite(photograph.variance[i]))
        continue;
      Sums& s = squares[{labels[i], y / block_px, x / block_px}];
      s.value += photograph.value[i];
      s.variance += photograph.variance[i];
      s.x += x + 0.5;
      s.y += y + 0.5;
      ++s.n;
    }
  const int full = block_px * block_px / (site == 'G' ? 2 : 4);
  std::vector<PatchBlock> blocks;
  for (const auto& [key, s] : squares) {
    if (2 * s.n < full) continue;
    const double n = s.n, value = s.value / n;
    blocks.push_back({frame.x(s.x / n), frame.y(s.y / n), value,
                      std::hypot(std::sqrt(s.variance / n), relative_u * value),
                      static_cast<std::size_t>(std::get<0>(key) - 1)});
  }
  return blocks;
}

CellPlane cell_plane(const Photograph& photograph, char site) {
  CellPlane plane{
      .width = photograph.width / 2, .height = photograph.height / 2, .value = {}, .variance = {}};
  for (int cy = 0; cy < plane.height; ++cy)
    for (int cx = 0; cx < plane.width; ++cx) {
      double value = 0.0, variance = 0.0, n = 0.0;
      for (int k = 0; k < 4; ++k) {
        const int x = 2 * cx + (k & 1), y = 2 * cy + (k >> 1);
        if (photograph.bayer.site(x, y) != site) continue;
        value += photograph.value[photograph.index(x, y)];
        variance += photograph.variance[photograph.index(x, y)];
        n += 1.0;
      }
      plane.value.push_back(static_cast<float>(value / n));
      plane.variance.push_back(static_cast<float>(variance / n));  // errors move together
    }
  return plane;
}

std::vector<std::uint8_t> cell_labels(const std::vector<std::uint8_t>& labels, int width,
                                      int height) {
  std::vector<std::uint8_t> cells;
  for (int cy = 0; cy < height / 2; ++cy)
    for (int cx = 0; cx < width / 2; ++cx) {
      const std::size_t i = static_cast<std::size_t>(2 * cy * width + 2 * cx);
      const std::size_t below = i + static_cast<std::size_t>(width);
      const bool same = labels[i] == labels[i + 1] && labels[i] == labels[below] &&
                        labels[i] == labels[below + 1];
      cells.push_back(same ? labels[i] : std::uint8_t{0});
    }
  return cells;
}

}  // namespace truebox

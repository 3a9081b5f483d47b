// SPDX-License-Identifier: BSD-3-Clause
// The detector and its 8-bit copy. Internal to this folder.
#pragma once

#include <optional>

#include "chart_finder/chart_finder.h"

namespace truebox::detail {

/// The copy that the detector sees; `step` photosites of the picture make one of its pixels.
struct ChartCopy {
  int width = 0, height = 0, step = 1;
  std::vector<std::uint8_t> rgb;
};
ChartCopy display_copy(const ChartPicture& picture);

struct DetectedChart {
  std::array<PixelPosition, 4> corners;  ///< px of the copy
  double colour_distance = 0.0;
};
std::optional<DetectedChart> detect_chart(const ChartCopy& copy);

}  // namespace truebox::detail

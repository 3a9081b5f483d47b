// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "chart_finder/detect_chart.h"

namespace truebox {
namespace {

void draw_line(ChartOverlay& overlay, PixelPosition a, PixelPosition b,
               const std::array<std::uint8_t, 3>& colour) {
  const double length = std::max(std::abs(b.x_px - a.x_px), std::abs(b.y_px - a.y_px));
  const int steps = static_cast<int>(std::min(2.0 * length + 1.0, 1e5));
  for (int k = 0; k <= steps; ++k) {
    const double share = static_cast<double>(k) / steps;
    const double px = a.x_px + share * (b.x_px - a.x_px), py = a.y_px + share * (b.y_px - a.y_px);
    if (!(px >= 0.0 && py >= 0.0 && px < overlay.width && py < overlay.height)) continue;
    const std::size_t i = static_cast<std::size_t>(py) * static_cast<std::size_t>(overlay.width) +
                          static_cast<std::size_t>(px);
    std::copy(colour.begin(), colour.end(), overlay.rgb.begin() + static_cast<long>(3 * i));
  }
}

}  // namespace

ChartOverlay chart_overlay(const ChartPicture& picture, const ChartFinding& finding) {
  const detail::ChartCopy copy = detail::display_copy(picture);
  // Small pictures are enlarged, so that a line does not cover what it frames.
  const int zoom = std::clamp(900 / std::max(copy.width, 1), 1, 4);
  ChartOverlay overlay{copy.width * zoom, copy.height * zoom, {}};
  overlay.rgb.resize(3 * static_cast<std::size_t>(overlay.width) *
                     static_cast<std::size_t>(overlay.height));
  for (int y = 0; y < overlay.height; ++y)
    for (int x = 0; x < overlay.width; ++x) {
      const std::size_t to =
          3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(overlay.width) +
               static_cast<std::size_t>(x));
      const std::size_t from =
          3 * (static_cast<std::size_t>(y / zoom) * static_cast<std::size_t>(copy.width) +
               static_cast<std::size_t>(x / zoom));
      std::copy_n(copy.rgb.begin() + static_cast<long>(from), 3,
                  overlay.rgb.begin() + static_cast<long>(to));
    }
  if (!finding.found) return overlay;
  const double scale = static_cast<double>(zoom) / copy.step;
  const auto draw = [&](const std::array<PixelPosition, 4>& outline,
                        const std::array<std::uint8_t, 3>& colour) {
    for (std::size_t k = 0; k < 4; ++k)
      draw_line(overlay, {outline[k].x_px * scale, outline[k].y_px * scale},
                {outline[(k + 1) % 4].x_px * scale, outline[(k + 1) % 4].y_px * scale}, colour);
  };
  draw(finding.corners, {255, 200, 0});
  for (const FoundPatch& patch : finding.patches) draw(patch.outline, {255, 0, 0});
  return overlay;
}

}  // namespace truebox

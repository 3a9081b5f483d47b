// SPDX-License-Identifier: BSD-3-Clause
#include "figures/line_overlay.h"

#include <algorithm>
#include <cmath>

namespace truebox {
namespace {

constexpr double kDimmed = 0.6;  // of the photograph's brightness

double srgb_coded(double v) {  // IEC 61966-2-1:1999, 5.2
  v = std::clamp(v, 0.0, 1.0);
  return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1.0 / 2.4) - 0.055;
}

std::vector<std::vector<float>> planes_of(const Image& image) {
  std::vector<std::vector<float>> planes;
  if (image.find("R") && image.find("G") && image.find("B")) {
    for (const char* name : {"R", "G", "B"}) planes.push_back(image.find(name)->samples);
    return planes;
  }
  planes.emplace_back(image.pixel_count(), 0.0f);
  for (const Channel& channel : image.channels)
    for (std::size_t i = 0; i < image.pixel_count(); ++i)
      if (std::isfinite(channel.samples[i]))
        planes[0][i] += channel.samples[i] / static_cast<float>(image.channels.size());
  return planes;
}

struct Canvas {
  int width, height;
  std::vector<std::uint8_t> rgb;

  void blend(int x, int y, const std::array<std::uint8_t, 3>& colour, double weight) {
    if (x < 0 || y < 0 || x >= width || y >= height || weight <= 0.0) return;
    for (std::size_t c = 0; c < 3; ++c) {
      std::uint8_t& v = rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                 static_cast<std::size_t>(x)) +
                            c];
      v = static_cast<std::uint8_t>(std::lround(v + weight * (colour[c] - v)));
    }
  }

  // Each pixel by its centre's distance from the line.
  void draw(double x0, double y0, double x1, double y1, const std::array<std::uint8_t, 3>& colour) {
    if (!std::isfinite(x0 + y0 + x1 + y1)) return;
    const double dx = x1 - x0, dy = y1 - y0, squared = dx * dx + dy * dy;
    const auto low = [](double a, double b, int most) {
      return static_cast<int>(std::clamp(std::floor(std::min(a, b)) - 1.0, 0.0, double(most)));
    };
    const auto high = [](double a, double b, int most) {
      return static_cast<int>(std::clamp(std::ceil(std::max(a, b)) + 1.0, 0.0, double(most)));
    };
    for (int y = low(y0, y1, height); y < high(y0, y1, height); ++y)
      for (int x = low(x0, x1, width); x < high(x0, x1, width); ++x) {
        const double px = x + 0.5 - x0, py = y + 0.5 - y0;
        const double t = squared > 0.0 ? std::clamp((px * dx + py * dy) / squared, 0.0, 1.0) : 0.0;
        blend(x, y, colour, 1.2 - std::hypot(px - t * dx, py - t * dy));
      }
  }
};

// n x n pixels of the photograph are one, or one is m x m.
Canvas backdrop(const Image& photograph, int n, int m) {
  const auto planes = planes_of(photograph);
  const auto transfer = photograph.attributes.find("transfer");
  const bool coded = transfer != photograph.attributes.end() && transfer->second == "sRGB";
  double white = 255.0;
  if (!coded) {
    std::vector<float> sorted;
    for (float v : planes.back())
      if (std::isfinite(v)) sorted.push_back(v);
    const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(0.98 * double(sorted.size()));
    if (at != sorted.end()) std::nth_element(sorted.begin(), at, sorted.end());
    white = at != sorted.end() && *at > 0.0f ? *at : 1.0;
  }
  Canvas canvas{photograph.width / n * m, photograph.height / n * m, {}};
  for (int y = 0; y < canvas.height; ++y)
    for (int x = 0; x < canvas.width; ++x)
      for (std::size_t c = 0; c < 3; ++c) {
        const auto& plane = planes[planes.size() == 3 ? c : 0];
        double sum = 0.0;
        for (int k = 0; k < n * n; ++k) {
          const float v = plane[photograph.index(x / m * n + k % n, y / m * n + k / n)];
          sum += std::isfinite(v) ? v : 0.0f;
        }
        const double v = sum / (n * n) / white;
        canvas.rgb.push_back(static_cast<std::uint8_t>(
            std::lround(255.0 * kDimmed * (coded ? std::clamp(v, 0.0, 1.0) : srgb_coded(v)))));
      }
  return canvas;
}

}  // namespace

Picture line_overlay(const Image& photograph, const std::vector<OverlayLine>& lines, int most_px,
                     std::string note) {
  int n = 1;
  while (std::max(photograph.width, photograph.height) > most_px * n) ++n;
  int m = 1;
  while (2 * m * std::max(photograph.width, photograph.height) <= most_px) m *= 2;
  const double scale = double(m) / n;
  Canvas canvas = backdrop(photograph, n, m);
  for (const OverlayLine& line : lines)
    canvas.draw(scale * line.from.x_px, scale * line.from.y_px, scale * line.to.x_px,
                scale * line.to.y_px, line.colour);
  return plain_picture(canvas.width, canvas.height, canvas.rgb, std::move(note));
}

}  // namespace truebox

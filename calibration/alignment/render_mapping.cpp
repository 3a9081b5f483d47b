// SPDX-License-Identifier: BSD-3-Clause
#include "alignment/render_mapping.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "alignment/edge_planes.h"

namespace truebox {
namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
constexpr double kNearer = 1.03;
constexpr int kMostPoints = 16;  // of a pixel, each way

/// What falls on each spot of the photograph and is nearest.
class NearestDepth {
 public:
  struct Nearest {
    double depth_m = std::numeric_limits<double>::infinity();
    int surface = 0;
  };
  NearestDepth(int width, int height, double spot_px)
      : spot_px_(spot_px),
        columns_(static_cast<int>(width / spot_px) + 1),
        rows_(static_cast<int>(height / spot_px) + 1),
        spots_(static_cast<std::size_t>(columns_ * rows_)) {}

  Nearest& at(PixelPosition p) {
    const int x = std::clamp(static_cast<int>(p.x_px / spot_px_), 0, columns_ - 1);
    const int y = std::clamp(static_cast<int>(p.y_px / spot_px_), 0, rows_ - 1);
    return spots_[static_cast<std::size_t>(y * columns_ + x)];
  }

 private:
  double spot_px_;
  int columns_, rows_;
  std::vector<Nearest> spots_;
};

double bilinear(const std::vector<float>& plane, int width, int height, double x_px, double y_px) {
  const double x = std::clamp(x_px - 0.5, 0.0, width - 1.0);
  const double y = std::clamp(y_px - 0.5, 0.0, height - 1.0);
  const int x0 = std::min(static_cast<int>(x), std::max(width - 2, 0));
  const int y0 = std::min(static_cast<int>(y), std::max(height - 2, 0));
  const double s = x - x0, t = y - y0;
  const auto value = [&](int dx, int dy) -> double {
    return plane[static_cast<std::size_t>(std::min(y0 + dy, height - 1) * width +
                                          std::min(x0 + dx, width - 1))];
  };
  return (1.0 - t) * ((1.0 - s) * value(0, 0) + s * value(1, 0)) +
         t * ((1.0 - s) * value(0, 1) + s * value(1, 1));
}

}  // namespace

Image photo_from_render(const RenderedView& view, const CameraParameters& parameters, int width,
                        int height) {
  const Image& render = view.picture();
  Image mapping(render.width, render.height);
  mapping.add_channel("x_px", kNone);
  mapping.add_channel("y_px", kNone);
  mapping.attributes["unit:x_px"] = mapping.attributes["unit:y_px"] = "px of the photograph";
  const auto forward = camera_from_world(parameters)[2];
  const double spot_px = 2.0 * std::max(1.0, double(width) / render.width);
  NearestDepth nearest(width, height, spot_px);
  std::vector<NearestDepth::Nearest> own(render.pixel_count());
  for (int y = 0; y < render.height; ++y)
    for (int x = 0; x < render.width; ++x) {
      const auto place = view.at_pixel(x, y);
      const auto at = place ? projected(parameters, place->point_m) : std::nullopt;
      if (!at || !(at->x_px >= 0.0 && at->y_px >= 0.0 && at->x_px < width && at->y_px < height))
        continue;
      const Vec3 point = stretched(parameters, place->point_m);
      const std::size_t i = mapping.index(x, y);
      own[i] = {forward[0] * point[0] + forward[1] * point[1] + forward[2] * point[2] + forward[3],
                place->surface};
      mapping.channels[0].samples[i] = static_cast<float>(at->x_px);
      mapping.channels[1].samples[i] = static_cast<float>(at->y_px);
      NearestDepth::Nearest& spot = nearest.at(*at);
      if (own[i].depth_m < spot.depth_m) spot = own[i];
    }
  // A flat surface does not hide itself, however slantwise it is seen.
  for (std::size_t i = 0; i < own.size(); ++i) {
    float &x = mapping.channels[0].samples[i], &y = mapping.channels[1].samples[i];
    if (!std::isfinite(x)) continue;
    const NearestDepth::Nearest& spot = nearest.at({x, y});
    if (spot.surface != own[i].surface && own[i].depth_m > kNearer * spot.depth_m) x = y = kNone;
  }
  return mapping;
}

Image in_render_pixels(const Image& photograph, const Image& mapping) {
  const auto &xs = mapping.channels[0].samples, &ys = mapping.channels[1].samples;
  // How far apart neighbouring pixels lie in the photograph.
  const auto step = [&](const std::vector<float>& v, int x, int y, int dx, int dy) -> double {
    const auto difference = [&](int from_x, int from_y, int to_x, int to_y) -> double {
      if (from_x < 0 || from_y < 0 || to_x >= mapping.width || to_y >= mapping.height)
        return std::numeric_limits<double>::quiet_NaN();
      return double{v[mapping.index(to_x, to_y)]} - double{v[mapping.index(from_x, from_y)]};
    };
    const double after = difference(x, y, x + dx, y + dy),
                 before = difference(x - dx, y - dy, x, y);
    // The smaller: at a silhouette the other one leaps.
    if (!std::isfinite(after)) return std::isfinite(before) ? before : 0.0;
    if (!std::isfinite(before)) return after;
    return std::abs(after) < std::abs(before) ? after : before;
  };
  Image seen(mapping.width, mapping.height);
  std::vector<std::vector<float>> light;
  for (const Channel& channel : photograph.channels) {
    seen.add_channel(channel.name, kNone);
    light.push_back(linear_light(photograph, channel));
  }
  for (int y = 0; y < mapping.height; ++y)
    for (int x = 0; x < mapping.width; ++x) {
      const std::size_t i = mapping.index(x, y);
      if (!std::isfinite(xs[i])) continue;
      const double ax = step(xs, x, y, 1, 0), ay = step(ys, x, y, 1, 0);
      const double bx = step(xs, x, y, 0, 1), by = step(ys, x, y, 0, 1);
      const double size = std::max(std::hypot(ax, ay), std::hypot(bx, by));
      const int n = std::clamp(static_cast<int>(std::ceil(size)), 1, kMostPoints);
      for (std::size_t c = 0; c < light.size(); ++c) {
        double sum = 0.0;
        for (int k = 0; k < n * n; ++k) {
          const double s = (k % n + 0.5) / n - 0.5, t = (k / n + 0.5) / n - 0.5;
          sum += bilinear(light[c], photograph.width, photograph.height, xs[i] + s * ax + t * bx,
                          ys[i] + s * ay + t * by);
        }
        seen.channels[c].samples[i] = static_cast<float>(sum / (n * n));
      }
    }
  return seen;
}

}  // namespace truebox

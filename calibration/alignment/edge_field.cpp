// SPDX-License-Identifier: BSD-3-Clause
#include "alignment/edge_field.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace truebox {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kRadius = 3;  // of the Gaussian, px

/// Gaussian of 1 px and its derivative at whole pixels, normalised to unit sum and unit slope.
struct Kernels {
  std::array<double, 2 * kRadius + 1> smooth{}, slope{};
  Kernels() {
    double sum = 0.0, moment = 0.0;
    for (int k = -kRadius; k <= kRadius; ++k) sum += std::exp(-0.5 * k * k);
    for (int k = -kRadius; k <= kRadius; ++k) {
      const auto i = static_cast<std::size_t>(k + kRadius);
      smooth[i] = std::exp(-0.5 * k * k) / sum;
      slope[i] = k * smooth[i];
      moment += k * slope[i];
    }
    for (double& v : slope) v /= moment;
  }
};

using Weights = std::array<double, 2 * kRadius + 1>;

// Correlates along one axis; beyond the border the last pixel goes on.
std::vector<float> filtered(const std::vector<float>& in, int width, int height, const Weights& w,
                            bool along_x) {
  std::vector<float> out(in.size());
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      double sum = 0.0;
      for (int k = -kRadius; k <= kRadius; ++k) {
        const int sx = along_x ? std::clamp(x + k, 0, width - 1) : x;
        const int sy = along_x ? y : std::clamp(y + k, 0, height - 1);
        sum += w[static_cast<std::size_t>(k + kRadius)] *
               in[static_cast<std::size_t>(sy) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(sx)];
      }
      out[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
          static_cast<std::size_t>(x)] = static_cast<float>(sum);
    }
  return out;
}

}  // namespace

EdgeField::EdgeField(int width, int height, const std::vector<std::vector<float>>& planes,
                     double scale)
    : width_(width), height_(height), scale_(scale) {
  find_edges(planes);
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  for (int d = 0; d < kDirections; ++d) {
    auto& nearest = nearest_[static_cast<std::size_t>(d)];
    nearest.assign(pixels, -1);
    for (std::size_t p = 0; p < points_.size(); ++p) {
      double turn = std::abs(points_[p].angle - d * kPi / kDirections);
      turn = std::min(turn, kPi - turn);
      if (turn > kPi / kDirections) continue;
      const int x = std::clamp(static_cast<int>(points_[p].x), 0, width - 1);
      const int y = std::clamp(static_cast<int>(points_[p].y), 0, height - 1);
      nearest[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
              static_cast<std::size_t>(x)] = static_cast<int>(p);
    }
    spread(nearest);
  }
}

void EdgeField::find_edges(const std::vector<std::vector<float>>& planes) {
  static const Kernels kKernels;
  const std::size_t pixels = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  std::vector<float> gx(pixels, 0.0f), gy(pixels, 0.0f), magnitude(pixels, 0.0f);
  for (const auto& plane : planes) {
    const auto px = filtered(filtered(plane, width_, height_, kKernels.slope, true), width_,
                             height_, kKernels.smooth, false);
    const auto py = filtered(filtered(plane, width_, height_, kKernels.smooth, true), width_,
                             height_, kKernels.slope, false);
    for (std::size_t i = 0; i < pixels; ++i) {
      const float m = std::hypot(px[i], py[i]);
      if (m <= magnitude[i]) continue;
      magnitude[i] = m;
      gx[i] = px[i];
      gy[i] = py[i];
    }
  }
  if (pixels == 0) return;
  std::vector<float> sorted = magnitude;
  const auto quantile = [&](double q) {
    const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(q * double(pixels - 1));
    std::nth_element(sorted.begin(), at, sorted.end());
    return *at;
  };
  const float median = quantile(0.5), strongest = quantile(0.998);
  const float least = std::max({3.0f * median, 0.02f * strongest, 1e-5f});
  for (int y = 1; y + 1 < height_; ++y)
    for (int x = 1; x + 1 < width_; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                            static_cast<std::size_t>(x);
      if (magnitude[i] < least) continue;
      const bool steep = std::abs(gy[i]) > std::abs(gx[i]);
      const std::size_t step = steep ? static_cast<std::size_t>(width_) : 1;
      const float before = magnitude[i - step], after = magnitude[i + step];
      if (magnitude[i] < before || magnitude[i] <= after) continue;
      const double curvature = double(before) + after - 2.0 * magnitude[i];
      const double shift =
          curvature < 0.0 ? std::clamp(0.5 * (double(before) - after) / curvature, -0.5, 0.5) : 0.0;
      double angle = std::atan2(gy[i], gx[i]);
      if (angle < 0.0) angle += kPi;
      if (angle >= kPi) angle -= kPi;
      points_.push_back({static_cast<float>(x + 0.5 + (steep ? 0.0 : shift)),
                         static_cast<float>(y + 0.5 + (steep ? shift : 0.0)),
                         static_cast<float>(angle)});
    }
}

void EdgeField::spread(std::vector<int>& nearest) const {
  const auto at = [&](int x, int y) -> int& {
    return nearest[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                   static_cast<std::size_t>(x)];
  };
  const auto squared = [&](int x, int y, int p) {
    const Point& point = points_[static_cast<std::size_t>(p)];
    const double dx = point.x - x - 0.5, dy = point.y - y - 0.5;
    return dx * dx + dy * dy;
  };
  const auto take = [&](int x, int y, int from_x, int from_y) {
    if (from_x < 0 || from_y < 0 || from_x >= width_ || from_y >= height_) return;
    const int p = at(from_x, from_y);
    int& mine = at(x, y);
    if (p >= 0 && (mine < 0 || squared(x, y, p) < squared(x, y, mine))) mine = p;
  };
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x)
      for (int k = -1; k <= 1; ++k) {
        take(x, y, x + k, y - 1);
        take(x, y, x - 1, y);
      }
    for (int x = width_ - 1; x >= 0; --x) take(x, y, x + 1, y);
  }
  for (int y = height_ - 1; y >= 0; --y) {
    for (int x = width_ - 1; x >= 0; --x)
      for (int k = -1; k <= 1; ++k) {
        take(x, y, x + k, y + 1);
        take(x, y, x + 1, y);
      }
    for (int x = 0; x < width_; ++x) take(x, y, x - 1, y);
  }
}

std::vector<EdgeField::Ridge> EdgeField::ridges() const {
  std::vector<Ridge> ridges;
  for (const Point& p : points_) ridges.push_back({{scale_ * p.x, scale_ * p.y}, p.angle});
  return ridges;
}

std::optional<EdgeField::Found> EdgeField::nearest(PixelPosition position,
                                                   const std::array<double, 2>& normal) const {
  const double x = position.x_px / scale_, y = position.y_px / scale_;
  if (!(x >= 0.0 && y >= 0.0 && x < width_ && y < height_)) return std::nullopt;
  double angle = std::atan2(normal[1], normal[0]);
  if (angle < 0.0) angle += kPi;
  const int direction = static_cast<int>(std::lround(angle * kDirections / kPi)) % kDirections;
  const int found = nearest_[static_cast<std::size_t>(direction)]
                            [static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                             static_cast<std::size_t>(x)];
  if (found < 0) return std::nullopt;
  const Point& point = points_[static_cast<std::size_t>(found)];
  const double dx = scale_ * (point.x - x), dy = scale_ * (point.y - y);
  return Found{std::hypot(dx, dy), dx * normal[0] + dy * normal[1]};
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "chart_finder/chart_finder.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

#include "chart_finder/detect_chart.h"

namespace truebox {
namespace {

// The detector's model of the chart: 6 x 4 patches of 2.5, gaps and rim of 0.25.
constexpr double kPatch = 2.5, kPitch = 2.75, kRim = 0.25, kWidth = 16.75, kHeight = 11.25;
constexpr double kMargin = 0.25;  // of a patch, on each side, left out: the model is not exact

/// Picture from chart: the projective map that takes the model's corners to those found.
Eigen::Matrix3d picture_from_chart(const std::array<PixelPosition, 4>& corners) {
  const double model[4][2] = {{0.0, 0.0}, {kWidth, 0.0}, {kWidth, kHeight}, {0.0, kHeight}};
  Eigen::Matrix<double, 8, 8> a = Eigen::Matrix<double, 8, 8>::Zero();
  Eigen::Matrix<double, 8, 1> b;
  for (int k = 0; k < 4; ++k) {
    const double x = model[k][0], y = model[k][1];
    const double u = corners[static_cast<std::size_t>(k)].x_px;
    const double v = corners[static_cast<std::size_t>(k)].y_px;
    a.row(2 * k) << x, y, 1, 0, 0, 0, -u * x, -u * y;
    a.row(2 * k + 1) << 0, 0, 0, x, y, 1, -v * x, -v * y;
    b[2 * k] = u;
    b[2 * k + 1] = v;
  }
  const Eigen::Matrix<double, 8, 1> h = a.colPivHouseholderQr().solve(b);
  Eigen::Matrix3d map;
  map << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1.0;
  return map;
}

PixelPosition mapped(const Eigen::Matrix3d& map, double x, double y) {
  const Eigen::Vector3d p = map * Eigen::Vector3d(x, y, 1.0);
  return {p[0] / p[2], p[1] / p[2]};
}

bool is_inside(const std::array<PixelPosition, 4>& outline, double x, double y) {
  int sign = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    const PixelPosition &a = outline[k], &b = outline[(k + 1) % 4];
    const double side = (b.x_px - a.x_px) * (y - a.y_px) - (b.y_px - a.y_px) * (x - a.x_px);
    const int s = side > 0.0 ? 1 : -1;
    if (sign != 0 && s != sign) return false;
    sign = s;
  }
  return true;
}

struct Sums {
  double value = 0.0, square = 0.0, noise2 = 0.0, common = 0.0;
  std::size_t n = 0;
};

PatchValue value_of(const Sums& s, const ChartPlane& plane, char site) {
  PatchValue v{.plane = plane.name, .site = site};
  v.samples = s.n;
  if (s.n == 0) return v;
  const double n = static_cast<double>(s.n);
  v.mean = s.value / n;
  v.scatter =
      s.n > 1 ? std::sqrt(std::max(s.square / n - v.mean * v.mean, 0.0) * n / (n - 1.0)) : 0.0;
  v.u_noise = plane.u_noise.empty() ? v.scatter / std::sqrt(n) : std::sqrt(s.noise2) / n;
  v.u_common = s.common / n;
  return v;
}

void measure(const ChartPicture& picture, FoundPatch& patch) {
  double x0 = 1e30, x1 = -1e30, y0 = 1e30, y1 = -1e30;
  for (const PixelPosition& p : patch.outline) {
    x0 = std::min(x0, p.x_px);
    x1 = std::max(x1, p.x_px);
    y0 = std::min(y0, p.y_px);
    y1 = std::max(y1, p.y_px);
  }
  const int left = std::max(static_cast<int>(x0), 0);
  const int right = std::min(static_cast<int>(x1) + 1, picture.width);
  const int top = std::max(static_cast<int>(y0), 0);
  const int bottom = std::min(static_cast<int>(y1) + 1, picture.height);
  for (const ChartPlane& plane : picture.planes) {
    std::map<char, Sums> sums;
    for (int y = top; y < bottom; ++y)
      for (int x = left; x < right; ++x) {
        if (!is_inside(patch.outline, x + 0.5, y + 0.5)) continue;
        const std::size_t i =
            static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width) +
            static_cast<std::size_t>(x);
        const double v = plane.value[i];
        if (!std::isfinite(v) || (!plane.u_noise.empty() && !std::isfinite(plane.u_noise[i])))
          continue;
        Sums& s = sums[picture.mosaic ? picture.bayer.site(x, y) : 'Y'];
        s.value += v;
        s.square += v * v;
        if (!plane.u_noise.empty()) s.noise2 += double{plane.u_noise[i]} * plane.u_noise[i];
        if (!plane.u_common.empty()) s.common += plane.u_common[i];
        ++s.n;
      }
    for (const auto& [site, s] : sums) patch.values.push_back(value_of(s, plane, site));
  }
}

}  // namespace

const std::vector<std::string>& colorchecker_patches() {
  static const std::vector<std::string> kNames = {
      "dark_skin", "light_skin",    "blue_sky",     "foliage",   "blue_flower",  "bluish_green",
      "orange",    "purplish_blue", "moderate_red", "purple",    "yellow_green", "orange_yellow",
      "blue",      "green",         "red",          "yellow",    "magenta",      "cyan",
      "white_9.5", "neutral_8",     "neutral_6.5",  "neutral_5", "neutral_3.5",  "black_2"};
  return kNames;
}

ChartFinding find_chart(const ChartPicture& picture) {
  if (picture.planes.size() != 1 && picture.planes.size() != 3)
    throw std::invalid_argument("a chart is looked for in one plane or in three");
  const std::size_t n =
      static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height);
  for (const ChartPlane& plane : picture.planes)
    if (plane.value.size() != n || (!plane.u_noise.empty() && plane.u_noise.size() != n) ||
        (!plane.u_common.empty() && plane.u_common.size() != n))
      throw std::invalid_argument(plane.name + ": a plane of another size");
  ChartFinding finding;
  const detail::ChartCopy copy = detail::display_copy(picture);
  const auto detected = detail::detect_chart(copy);
  if (!detected) {
    finding.why_not = "no field of 6 x 4 patches with a ColorChecker's colours was found";
    return finding;
  }
  for (std::size_t k = 0; k < 4; ++k)
    finding.corners[k] = {detected->corners[k].x_px * copy.step,
                          detected->corners[k].y_px * copy.step};
  finding.colour_distance = detected->colour_distance;
  const Eigen::Matrix3d map = picture_from_chart(finding.corners);
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 6; ++column) {
      FoundPatch patch;
      patch.name = colorchecker_patches()[static_cast<std::size_t>(6 * row + column)];
      const double x = kRim + kPitch * column, y = kRim + kPitch * row;
      const double a = kMargin * kPatch, b = (1.0 - kMargin) * kPatch;
      patch.outline = {mapped(map, x + a, y + a), mapped(map, x + b, y + a),
                       mapped(map, x + b, y + b), mapped(map, x + a, y + b)};
      measure(picture, patch);
      finding.patches.push_back(std::move(patch));
    }
  const bool measured = std::all_of(
      finding.patches.begin(), finding.patches.end(),
      [](const FoundPatch& patch) { return !patch.values.empty() && patch.values[0].samples > 0; });
  if (!measured) {
    finding.patches.clear();
    finding.why_not = "a chart seems to be there, but some patch holds no measured sample";
    return finding;
  }
  finding.found = true;
  return finding;
}

}  // namespace truebox

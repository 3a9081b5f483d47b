// SPDX-License-Identifier: BSD-3-Clause
#include "transport/visible_parts.h"

#include <algorithm>
#include <cmath>

namespace truebox {
namespace {
constexpr double kTolerance = 1e-12;  // of the lengths at hand: rounding of a few operations
}

bool may_block(const Blocker& blocker, const Vec3& point, std::span<const Vec3> source,
               const Plane& source_plane, double tolerance_m) {
  const double side = blocker.plane.distance_m(point);
  if (std::abs(side) <= tolerance_m) return false;  // seen edge-on
  bool beyond = false;
  for (const Vec3& v : source)
    beyond |=
        (side > 0.0 ? blocker.plane.distance_m(v) : -blocker.plane.distance_m(v)) < -tolerance_m;
  if (!beyond) return false;
  return std::any_of(blocker.polygon.begin(), blocker.polygon.end(),
                     [&](const Vec3& v) { return source_plane.distance_m(v) > tolerance_m; });
}

void PointShadow::cast(const Vec3& point, const Blocker& blocker) {
  sides.clear();
  const double side = blocker.plane.distance_m(point) > 0.0 ? 1.0 : -1.0;
  near = {side * blocker.plane.normal, side * blocker.plane.offset_m};
  const std::size_t n = blocker.polygon.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3 a = blocker.polygon[i] - point, b = blocker.polygon[(i + 1) % n] - point;
    const Vec3 outward = side * a.cross(b);
    const double length = outward.norm();
    if (length > 0.0) sides.push_back({outward / length, outward.dot(point) / length});
  }
}

// Most blockers that may hide a part of the source hide nothing of most of its parts.
bool PointShadow::misses(std::span<const Vec3> polygon, double tolerance_m) const {
  const auto none_behind = [&](const Plane& plane) {
    return std::none_of(polygon.begin(), polygon.end(),
                        [&](const Vec3& v) { return plane.distance_m(v) < -tolerance_m; });
  };
  return none_behind(near) || std::any_of(sides.begin(), sides.end(), none_behind);
}

bool PointShadow::covers(std::span<const Vec3> polygon, double tolerance_m) const {
  const auto all_behind = [&](const Plane& plane) {
    return std::all_of(polygon.begin(), polygon.end(),
                       [&](const Vec3& v) { return plane.distance_m(v) < -tolerance_m; });
  };
  return all_behind(near) && std::all_of(sides.begin(), sides.end(), all_behind);
}

void VisibleParts::remove_shadow(const Vec3& point, const Blocker& blocker) {
  rest_.clear();
  shadow_.cast(point, blocker);
  const Plane& near = shadow_.near;
  for (Polygon& part : parts_) {
    if (shadow_.misses(part, kTolerance * (part[0] - point).norm())) {
      rest_.push_back(std::move(part));
      continue;
    }
    const std::size_t before = rest_.size();
    current_ = part;
    for (std::size_t i = 0; i < shadow_.sides.size() && !current_.empty(); ++i) {
      const Plane& edge = shadow_.sides[i];
      const double tolerance = kTolerance * (current_[0] - point).norm();
      clip(current_, edge, tolerance, outside_);
      if (!outside_.empty()) rest_.push_back(outside_);
      clip(current_, Plane{-edge.normal, -edge.offset_m}, tolerance, inside_);
      current_.swap(inside_);
    }
    const double tolerance = current_.empty() ? 0.0 : kTolerance * (current_[0] - point).norm();
    const bool is_hidden = std::any_of(current_.begin(), current_.end(), [&](const Vec3& v) {
      return near.distance_m(v) < -tolerance;
    });
    if (!is_hidden) {  // whole again: cuts that hide nothing would multiply with every blocker
      rest_.resize(before);
      rest_.push_back(std::move(part));
      continue;
    }
    clip(current_, near, tolerance, outside_);
    if (!outside_.empty()) rest_.push_back(outside_);
  }
  parts_.swap(rest_);
}

std::span<const Polygon> VisibleParts::operator()(const Vec3& point, std::span<const Vec3> source,
                                                  const Plane& source_plane,
                                                  std::span<const Blocker* const> blockers) {
  parts_.clear();
  parts_.emplace_back(source.begin(), source.end());
  const double tolerance = kTolerance * (source[0] - point).norm();
  for (const Blocker* blocker : blockers)
    if (!parts_.empty() && may_block(*blocker, point, source, source_plane, tolerance))
      remove_shadow(point, *blocker);
  return parts_;
}

}  // namespace truebox

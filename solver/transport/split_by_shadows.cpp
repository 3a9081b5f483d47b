// SPDX-License-Identifier: BSD-3-Clause
#include "transport/split_by_shadows.h"

#include <algorithm>
#include <cmath>

namespace truebox {
namespace {
constexpr double kTolerance = 1e-12;  // of the lengths at hand: rounding of a few operations
}

void SplitByShadows::remove_shadow(const Vec3& point, const Blocker& blocker) {
  const double side = blocker.plane.distance_m(point) > 0.0 ? 1.0 : -1.0;
  const std::size_t n = blocker.polygon.size();
  edges_.clear();
  Vec3 a = blocker.polygon[n - 1] - point;
  for (const Vec3& vertex : blocker.polygon) {
    const Vec3 b = vertex - point, outward = side * a.cross(b);
    const double length = outward.norm();
    if (length > 0.0) edges_.push_back({outward / length, outward.dot(point) / length});
    a = b;
  }
  const Plane near{side * blocker.plane.normal, side * blocker.plane.offset_m};
  rest_.count = 0;
  for (std::size_t k = 0; k < parts_.count; ++k) cut_part(point, near, parts_.polygons[k]);
  std::swap(parts_, rest_);
}

void SplitByShadows::cut_part(const Vec3& point, const Plane& near, Polygon& part) {
  const double tolerance = kTolerance * (part[0] - point).norm();
  const auto all_beyond = [&](const Plane& plane) {
    return std::all_of(part.begin(), part.end(),
                       [&](const Vec3& v) { return plane.distance_m(v) >= -tolerance; });
  };
  // Most parts lie beside the shadow: they stay in one piece.
  if (all_beyond(near) || std::any_of(edges_.begin(), edges_.end(), all_beyond)) {
    rest_.add().swap(part);
    return;
  }
  for (const Plane& edge : edges_) {
    clip(part, edge, tolerance, outside_);
    if (outside_.empty()) continue;
    rest_.add().swap(outside_);
    clip(part, Plane{-edge.normal, -edge.offset_m}, tolerance, inside_);
    part.swap(inside_);
    if (part.empty()) return;
  }
  clip(part, near, tolerance, outside_);
  if (!outside_.empty()) rest_.add().swap(outside_);
  clip(part, Plane{-near.normal, -near.offset_m}, tolerance, inside_);
  if (!inside_.empty()) hidden_.add().swap(inside_);
}

std::span<const Polygon> SplitByShadows::operator()(const Vec3& point, std::span<const Vec3> source,
                                                    const Plane& source_plane,
                                                    std::span<const Blocker* const> blockers) {
  parts_.count = hidden_.count = 0;
  parts_.add().assign(source.begin(), source.end());
  const double tolerance = kTolerance * (source[0] - point).norm();
  for (const Blocker* blocker : blockers)
    if (parts_.count > 0 && may_block(*blocker, point, source, source_plane, tolerance))
      remove_shadow(point, *blocker);
  return {parts_.polygons.data(), parts_.count};
}

}  // namespace truebox

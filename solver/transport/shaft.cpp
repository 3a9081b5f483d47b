// SPDX-License-Identifier: BSD-3-Clause
#include "transport/shaft.h"

#include <array>
#include <cstdint>

namespace truebox {
namespace {

constexpr std::size_t kMostVertices = 32;  // beyond, the answer is "partial"

struct Heights {
  std::array<double, kMostVertices> of{};
  bool front = false, behind = false;

  Heights(std::span<const Vec3> polygon, const Plane& plane, double tolerance) {
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      of[k] = plane.distance_m(polygon[k]);
      front |= of[k] > tolerance;
      behind |= of[k] < -tolerance;
    }
  }
};

bool any_in_front(std::span<const Vec3> polygon, const Plane& plane, double tolerance) {
  for (const Vec3& v : polygon)
    if (plane.distance_m(v) > tolerance) return true;
  return false;
}

// Collects crossing points and remembers which edges of the blocker have all of them outside.
class Crossings {
 public:
  Crossings(const Blocker& blocker, double tolerance)
      : blocker_(blocker), tolerance_(tolerance), separates_((1ull << blocker.polygon.size()) - 1) {
    const Polygon& p = blocker.polygon;
    for (std::size_t e = 0; e < p.size(); ++e) {
      const Vec3 along = p[(e + 1) % p.size()] - p[e];
      outward_[e] = along.cross(blocker.plane.normal) / along.norm();
    }
  }

  void add(const Vec3& point) {
    for (std::size_t e = 0; e < blocker_.polygon.size(); ++e) {
      const double outside = outward_[e].dot(point - blocker_.polygon[e]);
      if (outside < -tolerance_) separates_ &= ~(1ull << e);
      if (outside > tolerance_) inside_ = false;
    }
  }

  void add_plane_crossings(std::span<const Vec3> polygon, const Heights& height) {
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      const std::size_t next = (k + 1) % polygon.size();
      const double h = height.of[k], g = height.of[next];
      if (h * g < 0.0) add(polygon[k] + h / (h - g) * (polygon[next] - polygon[k]));
    }
  }

  bool separated() const { return separates_ != 0; }
  bool inside() const { return inside_; }

 private:
  const Blocker& blocker_;
  double tolerance_;
  std::uint64_t separates_;
  std::array<Vec3, kMostVertices> outward_;
  bool inside_ = true;
};

}  // namespace

ShaftOcclusion shaft_occlusion(std::span<const Vec3> a, const Plane& plane_a,
                               std::span<const Vec3> b, const Plane& plane_b,
                               const Blocker& blocker, double tolerance_m) {
  if (std::max({a.size(), b.size(), blocker.polygon.size()}) > kMostVertices)
    return ShaftOcclusion::partial;
  const Heights height_a(a, blocker.plane, tolerance_m), height_b(b, blocker.plane, tolerance_m);
  if (!(height_a.front || height_b.front) || !(height_a.behind || height_b.behind))
    return ShaftOcclusion::none;
  if (!any_in_front(blocker.polygon, plane_a, tolerance_m) ||
      !any_in_front(blocker.polygon, plane_b, tolerance_m))
    return ShaftOcclusion::none;
  const bool straddles_a = height_a.front && height_a.behind;
  const bool straddles_b = height_b.front && height_b.behind;
  Crossings crossings(blocker, tolerance_m);
  for (std::size_t k = 0; k < a.size(); ++k)
    for (std::size_t l = 0; l < b.size(); ++l) {
      const double h = height_a.of[k], g = height_b.of[l];
      if (h * g > 0.0 || std::abs(h - g) <= tolerance_m) continue;
      crossings.add(a[k] + h / (h - g) * (b[l] - a[k]));
      if (!crossings.separated() && !crossings.inside()) return ShaftOcclusion::partial;
    }
  if (straddles_a) crossings.add_plane_crossings(a, height_a);
  if (straddles_b) crossings.add_plane_crossings(b, height_b);
  if (crossings.separated()) return ShaftOcclusion::none;
  // Where a polygon crosses the blocker's plane, its parts on the other's side are not hidden.
  return crossings.inside() && !straddles_a && !straddles_b ? ShaftOcclusion::full
                                                            : ShaftOcclusion::partial;
}

}  // namespace truebox

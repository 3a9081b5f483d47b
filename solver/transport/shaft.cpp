// SPDX-License-Identifier: BSD-3-Clause
#include "transport/shaft.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace truebox {
namespace {

constexpr std::size_t kMostVertices = 16;  // beyond, the answer is "partial"

using Heights = std::array<double, kMostVertices>;

struct Sides {
  bool front = false, behind = false;
};

Sides measure(std::span<const Vec3> polygon, const Plane& plane, double tolerance,
              Heights& height) {
  Sides sides;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    height[k] = plane.distance_m(polygon[k]);
    sides.front |= height[k] > tolerance;
    sides.behind |= height[k] < -tolerance;
  }
  return sides;
}

bool any_in_front(std::span<const Vec3> polygon, const Plane& plane, double tolerance) {
  for (const Vec3& v : polygon)
    if (plane.distance_m(v) > tolerance) return true;
  return false;
}

// Where crossing points lie of one edge's plane: all outside it, all inside it, or both.
class EdgeSide {
 public:
  explicit EdgeSide(double tolerance) : tolerance_(tolerance) {}

  // The crossing is (h e_b - g e_a) / (h - g) beyond the edge: no division is needed for its sign.
  void add_segment(double h, double g, double e_a, double e_b) {
    const double apart = h - g;
    add(apart > 0.0 ? h * e_b - g * e_a : g * e_a - h * e_b, std::abs(apart) * tolerance_);
  }
  bool all_outside() const { return !some_inside_; }
  bool all_inside() const { return !some_outside_; }
  bool decided() const { return some_inside_ && some_outside_; }

 private:
  void add(double beyond, double slack) {
    some_inside_ |= beyond < -slack;
    some_outside_ |= beyond > slack;
  }

  double tolerance_;
  bool some_inside_ = false, some_outside_ = false;
};

}  // namespace

ShaftBlocker::ShaftBlocker(Blocker convex) : blocker(std::move(convex)) {
  const Polygon& p = blocker.polygon;
  for (std::size_t k = 0; k < p.size(); ++k) {
    const Vec3 outward = (p[(k + 1) % p.size()] - p[k]).cross(blocker.plane.normal).normalized();
    edges.push_back({outward, outward.dot(p[k])});
  }
}

ShaftOcclusion shaft_occlusion(std::span<const Vec3> a, const Plane& plane_a,
                               std::span<const Vec3> b, const Plane& plane_b,
                               const ShaftBlocker& blocker, double tolerance_m) {
  if (std::max(a.size(), b.size()) > kMostVertices) return ShaftOcclusion::partial;
  Heights height_a, height_b, beyond_a, beyond_b;
  const Sides side_a = measure(a, blocker.blocker.plane, tolerance_m, height_a);
  const Sides side_b = measure(b, blocker.blocker.plane, tolerance_m, height_b);
  if (!(side_a.front || side_b.front) || !(side_a.behind || side_b.behind))
    return ShaftOcclusion::none;
  if (!any_in_front(blocker.blocker.polygon, plane_a, tolerance_m) ||
      !any_in_front(blocker.blocker.polygon, plane_b, tolerance_m))
    return ShaftOcclusion::none;
  const bool a_crosses = side_a.front && side_a.behind, b_crosses = side_b.front && side_b.behind;
  bool inside = !a_crosses && !b_crosses;  // parts on one side of the blocker see each other
  for (const Plane& edge : blocker.edges) {
    for (std::size_t k = 0; k < a.size(); ++k) beyond_a[k] = edge.distance_m(a[k]);
    for (std::size_t l = 0; l < b.size(); ++l) beyond_b[l] = edge.distance_m(b[l]);
    EdgeSide side(tolerance_m);
    const auto add = [&](double h, double g, double e, double f) {
      if (h * g <= 0.0 && std::abs(h - g) > tolerance_m) side.add_segment(h, g, e, f);
    };
    for (std::size_t k = 0; k < a.size() && !side.decided(); ++k)
      for (std::size_t l = 0; l < b.size(); ++l)
        add(height_a[k], height_b[l], beyond_a[k], beyond_b[l]);
    // A polygon that crosses the plane meets it along its own edges, too.
    for (std::size_t k = 0; a_crosses && k < a.size(); ++k)
      add(height_a[k], height_a[(k + 1) % a.size()], beyond_a[k], beyond_a[(k + 1) % a.size()]);
    for (std::size_t l = 0; b_crosses && l < b.size(); ++l)
      add(height_b[l], height_b[(l + 1) % b.size()], beyond_b[l], beyond_b[(l + 1) % b.size()]);
    if (side.all_outside()) return ShaftOcclusion::none;
    inside &= side.all_inside();
  }
  return inside ? ShaftOcclusion::full : ShaftOcclusion::partial;
}

ShaftOcclusion shaft_occlusion(std::span<const Vec3> a, const Plane& plane_a,
                               std::span<const Vec3> b, const Plane& plane_b,
                               const Blocker& blocker, double tolerance_m) {
  return shaft_occlusion(a, plane_a, b, plane_b, ShaftBlocker(blocker), tolerance_m);
}

}  // namespace truebox

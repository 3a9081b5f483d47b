// SPDX-License-Identifier: BSD-3-Clause
#include "transport/nusselt.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace truebox {
namespace {

// Calls visit(direction) for the start of each chord along the great circles between the corners.
template <class Visit>
void walk_outline(const Vec3& point, const Vec3& normal, std::span<const Vec3> polygon, int arcs,
                  const Visit& visit) {
  const Plane horizon{normal, normal.dot(point)};
  double reach = 0.0;
  for (const Vec3& v : polygon) reach = std::max(reach, (v - point).norm());
  Polygon above;
  clip(polygon, horizon, 1e-13 * reach, above);
  for (std::size_t k = 0; k < above.size(); ++k) {
    const Vec3 a = above[k] - point, b = above[(k + 1) % above.size()] - point;
    const Vec3 across = a.cross(b);
    const double angle = std::atan2(across.norm(), a.dot(b));
    const Vec3 u = a.normalized();
    const Vec3 w = angle > 0.0 ? Vec3(across.cross(a).normalized()) : Vec3(Vec3::Zero());
    for (int s = 0; s < arcs; ++s) {
      const double phi = angle * s / arcs;
      visit(Vec3(std::cos(phi) * u + std::sin(phi) * w));
    }
  }
}

}  // namespace

std::vector<Eigen::Vector2d> nusselt_outline(const Vec3& point, const Vec3& normal,
                                             std::span<const Vec3> polygon, int arcs) {
  const Vec3 t = normal.unitOrthogonal(), b = normal.cross(t);
  std::vector<Eigen::Vector2d> outline;
  if (plane_of(polygon).distance_m(point) <= 0.0) return outline;
  walk_outline(point, normal, polygon, arcs,
               [&](const Vec3& d) { outline.emplace_back(t.dot(d), b.dot(d)); });
  return outline;
}

double nusselt_factor(const Vec3& point, const Vec3& normal, std::span<const Vec3> polygon,
                      int arcs) {
  Vec3 first = Vec3::Zero(), previous = Vec3::Zero(), twice_area = Vec3::Zero();
  bool started = false;
  walk_outline(point, normal, polygon, arcs, [&](const Vec3& d) {
    if (started)
      twice_area += (previous - first).cross(d - first);
    else
      first = d;
    started = true;
    previous = d;
  });
  // Seen from above the element a lit polygon runs clockwise.
  return std::max(0.0, -normal.dot(twice_area) / (2.0 * std::numbers::pi));
}

}  // namespace truebox

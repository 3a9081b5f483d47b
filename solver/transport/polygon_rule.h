// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "scene/polygon.h"
#include "transport/quadrature.h"

namespace truebox {

/// Calls visit(i, j, point, area) for a `points` x `points` Gauss rule on a bilinear quad (a
/// triangle repeats a corner): `area` (m^2) is that of the unit square about the point, its weight
/// gauss_rule's of i times that of j.
template <class Visit>
void for_each_gauss_point_of_quad(const std::array<Vec3, 4>& q, const Vec3& normal, int points,
                                  const Visit& visit) {
  const GaussRule& rule = gauss_rule(points);
  for (int j = 0; j < points; ++j)
    for (int i = 0; i < points; ++i) {
      const double u = rule.nodes[i], v = rule.nodes[j];
      const Vec3 du = (1 - v) * (q[1] - q[0]) + v * (q[2] - q[3]);
      const Vec3 dv = (1 - u) * (q[3] - q[0]) + u * (q[2] - q[1]);
      visit(i, j, Vec3((1 - v) * ((1 - u) * q[0] + u * q[1]) + v * ((1 - u) * q[3] + u * q[2])),
            normal.dot(du.cross(dv)));
    }
}

/// Calls visit(point, weight) for a `points` x `points` Gauss rule on a quad, or on each triangle
/// of a fan over another convex polygon; weights sum to 1.
template <class Visit>
void for_each_gauss_point(const Polygon& polygon, int points, const Visit& visit) {
  const GaussRule& rule = gauss_rule(points);
  const Vec3 area_m2 = area_vector(polygon);
  const Vec3 normal = area_m2.normalized();
  const bool quad = polygon.size() == 4;
  for (std::size_t k = 2; k < (quad ? 3 : polygon.size()); ++k)
    for_each_gauss_point_of_quad(
        {polygon[0], polygon[k - 1], polygon[k], quad ? polygon[3] : polygon[0]}, normal, points,
        [&](int i, int j, const Vec3& point, double area) {
          visit(point, rule.weights[i] * rule.weights[j] * area / area_m2.norm());
        });
}

}  // namespace truebox

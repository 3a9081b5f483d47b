// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "scene/polygon.h"
#include "transport/quadrature.h"

namespace truebox {

/// Calls visit(point, weight) for a `points` x `points` Gauss rule on a quad, or on each triangle
/// of a fan over another convex polygon; weights sum to 1.
template <class Visit>
void for_each_gauss_point(const Polygon& polygon, int points, const Visit& visit) {
  const GaussRule& rule = gauss_rule(points);
  const Vec3 area = area_vector(polygon);
  const Vec3 normal = area.normalized();
  const bool quad = polygon.size() == 4;
  for (std::size_t k = 2; k < (quad ? 3 : polygon.size()); ++k) {
    const Vec3 &a = polygon[0], &b = polygon[k - 1], &c = polygon[k], &d = quad ? polygon[3] : a;
    for (int j = 0; j < points; ++j)
      for (int i = 0; i < points; ++i) {
        const double u = rule.nodes[i], v = rule.nodes[j];
        const Vec3 du = (1 - v) * (b - a) + v * (c - d), dv = (1 - u) * (d - a) + u * (c - b);
        visit(Vec3((1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * d + u * c)),
              rule.weights[i] * rule.weights[j] * normal.dot(du.cross(dv)) / area.norm());
      }
  }
}

}  // namespace truebox

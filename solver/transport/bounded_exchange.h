// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "transport/form_factor.h"

namespace truebox {

/// An exchange area and what it can be wrong by, m^2.
struct BoundedExchange {
  double exchange_area_m2 = 0.0;
  double error_bound_m2 = 0.0;
};

/// exchange_area_m2 with its bound: the tolerance, and rounding in proportion to the terms that
/// were summed, so that a sum that cancels says so. The coordinates are taken as exact.
BoundedExchange bounded_exchange(const PlanarPolygon& i, const PlanarPolygon& j,
                                 double relative_tolerance);

/// The terms of point_to_polygon's sum without their signs: its rounding is some epsilons of them.
double lambert_terms(const Vec3& point, const Vec3& normal, std::span<const Vec3> polygon);

/// The parts of two polygons in front of each other; false if either has none.
bool facing_parts(const PlanarPolygon& i, const PlanarPolygon& j, Polygon& part_i, Polygon& part_j);

}  // namespace truebox

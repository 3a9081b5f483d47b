// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "scene/polygon.h"

namespace truebox {

/// View factor from a surface element at `point` with unit `normal` to a polygon, nothing between:
///   F = -1/(2 pi) sum_i gamma_i (n . Gamma_i),   gamma_i = atan2(|a x b|, a . b),
/// the polygon cut at the element's horizon. In [0, 1]; 0 where the polygon shows its back.
/// Exact to rounding. Source: Lambert (1760); Baum, Rushmeier, Winget (1989), eq. 5.
double point_to_polygon(const Vec3& point, const Vec3& normal, std::span<const Vec3> polygon);

/// A convex polygon with what every pair it belongs to asks for.
struct PlanarPolygon {
  Polygon vertices;
  Plane plane;
  Vec3 centroid = Vec3::Zero();
  double area_m2 = 0.0;
  double radius_m = 0.0;  ///< about the centroid

  explicit PlanarPolygon(Polygon polygon);
};

/// Exchange area A_i F_ij = A_j F_ji (m^2) of two convex polygons, nothing between, each cut at the
/// other's horizon:
///   A_i F_ij = 1/pi integral integral cos_i cos_j / r^2 dA_j dA_i.
/// Lambert's formula integrated by Gauss quadrature over the smaller polygon where that converges
/// fast, otherwise the double contour integral 1/(2 pi) oint oint ln r dr_i . dr_j with one
/// integral in closed form and the other split geometrically towards touching points. Symmetric in
/// its arguments. `relative_tolerance` >= 1e-13 chooses the quadrature's order. Sources: Sparrow
/// (1963); Schroeder & Hanrahan (1993).
double exchange_area_m2(const PlanarPolygon& i, const PlanarPolygon& j, double relative_tolerance);

}  // namespace truebox

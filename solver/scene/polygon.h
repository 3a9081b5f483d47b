// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <span>
#include <vector>

namespace truebox {

using Vec3 = Eigen::Vector3d;

/// A planar polygon, vertices in m, counter-clockwise seen from its lit side (right-hand normal).
using Polygon = std::vector<Vec3>;

/// The plane { x : normal . x = offset_m }; positive distance is the side the normal points to.
struct Plane {
  Vec3 normal = Vec3::UnitZ();
  double offset_m = 0.0;

  double distance_m(const Vec3& point) const { return normal.dot(point) - offset_m; }
};

/// Area vector (1/2) sum v_i x v_{i+1} about the first vertex; its length is the area, m^2.
Vec3 area_vector(std::span<const Vec3> polygon);

/// Area-weighted centroid, m.
Vec3 centroid(std::span<const Vec3> polygon);

/// Plane through the centroid, normal to the area vector.
Plane plane_of(std::span<const Vec3> polygon);

/// Largest distance of two vertices, m.
double diameter_m(std::span<const Vec3> polygon);

/// Every interior angle at most pi, within `tolerance_m` of collinear.
bool is_convex(std::span<const Vec3> polygon, double tolerance_m);

/// Writes the part of a convex polygon on the plane's positive side into `kept` (may be empty).
/// Vertices closer than `tolerance_m` count as on the plane.
void clip(std::span<const Vec3> polygon, const Plane& plane, double tolerance_m, Polygon& kept);

/// Convex pieces that cover a simple polygon without its holes, each with the polygon's normal.
/// Empty if the outline or a hole crosses itself. Ear clipping for an outline that is not convex.
std::vector<Polygon> convex_pieces(const Polygon& outline, const std::vector<Polygon>& holes);

}  // namespace truebox

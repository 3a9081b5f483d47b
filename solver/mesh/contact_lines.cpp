// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/contact_lines.h"

#include <algorithm>
#include <cmath>

namespace truebox {
namespace {

// The part [t0, t1] of the segment inside the convex polygon shrunk by `margin`; false if none.
bool crosses_inside(const Vec3& from, const Vec3& to, const Polygon& polygon, const Vec3& normal,
                    double margin) {
  double t0 = 0.0, t1 = 1.0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec3 inward = normal.cross(polygon[(i + 1) % polygon.size()] - polygon[i]).normalized();
    const double da = inward.dot(from - polygon[i]) - margin;
    const double db = inward.dot(to - polygon[i]) - margin;
    if (da <= 0.0 && db <= 0.0) return false;
    if (da < 0.0) t0 = std::max(t0, da / (da - db));
    if (db < 0.0) t1 = std::min(t1, da / (da - db));
  }
  return (t1 - t0) * (to - from).norm() > margin;
}

// Where a convex polygon meets a plane: its edges if it lies in it, else at most one segment.
std::vector<ContactLine> traces(const Polygon& other, const Plane& plane, double tolerance) {
  std::vector<ContactLine> lines;
  std::vector<Vec3> met;
  bool is_flat = true;
  for (std::size_t i = 0; i < other.size(); ++i) {
    const Vec3 &a = other[i], &b = other[(i + 1) % other.size()];
    const double da = plane.distance_m(a), db = plane.distance_m(b);
    lines.push_back({a, b});
    is_flat = is_flat && std::abs(da) <= tolerance;
    if (std::abs(da) <= tolerance)
      met.push_back(a);
    else if (std::abs(db) > tolerance && da * db < 0.0)
      met.push_back(a + da / (da - db) * (b - a));
  }
  if (is_flat) return lines;
  if (met.size() != 2) return {};
  return {{met[0], met[1]}};
}

}  // namespace

bool is_crossed(const Polygon& cell, const Scene& scene) {
  const Plane plane = plane_of(cell);
  const double margin = 1e-6 * diameter_m(cell);
  for (const Surface& surface : scene.surfaces) {
    if (surface.is_opening) continue;
    for (const Polygon& other : surface.pieces)
      for (const ContactLine& line : traces(other, plane, margin))
        if (crosses_inside(line.from, line.to, cell, plane.normal, margin)) return true;
  }
  return false;
}

std::vector<ContactLine> contact_lines(const Polygon& piece, const Scene& scene) {
  const Plane plane = plane_of(piece);
  const double size = diameter_m(piece), tolerance = 1e-7 * size;
  std::vector<ContactLine> lines;
  for (const Surface& surface : scene.surfaces)
    for (const Polygon& other : surface.pieces) {
      if (plane_of(other).normal.cross(plane.normal).norm() < 1e-9) continue;  // coplanar
      for (std::size_t i = 0; i < other.size(); ++i) {
        const Vec3 &a = other[i], &b = other[(i + 1) % other.size()];
        if (std::abs(plane.distance_m(a)) > tolerance || std::abs(plane.distance_m(b)) > tolerance)
          continue;
        if (crosses_inside(a, b, piece, plane.normal, tolerance)) lines.push_back({a, b});
      }
    }
  return lines;
}

std::vector<Polygon> cut_along(const std::vector<Polygon>& cells,
                               const std::vector<ContactLine>& lines, const Vec3& normal) {
  std::vector<Polygon> result = cells, next;
  Polygon left, right;
  for (const ContactLine& line : lines) {
    next.clear();
    const Vec3 across = normal.cross(line.to - line.from).normalized();
    const Plane side{across, across.dot(line.from)};
    for (const Polygon& cell : result) {
      const double margin = 1e-6 * diameter_m(cell);
      if (!crosses_inside(line.from, line.to, cell, normal, margin)) {
        next.push_back(cell);
        continue;
      }
      clip(cell, side, margin, left);
      clip(cell, Plane{-side.normal, -side.offset_m}, margin, right);
      if (!left.empty()) next.push_back(left);
      if (!right.empty()) next.push_back(right);
    }
    result.swap(next);
  }
  return result;
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "scene/polygon.h"

#include <algorithm>

namespace truebox {

Vec3 area_vector(std::span<const Vec3> polygon) {
  Vec3 sum = Vec3::Zero();
  // Differences to the first vertex keep the digits of a small polygon far from the origin.
  for (std::size_t i = 2; i < polygon.size(); ++i)
    sum += (polygon[i - 1] - polygon[0]).cross(polygon[i] - polygon[0]);
  return 0.5 * sum;
}

Vec3 centroid(std::span<const Vec3> polygon) {
  const Vec3 normal = area_vector(polygon).normalized();
  Vec3 moment = Vec3::Zero();
  double area = 0.0;
  for (std::size_t i = 2; i < polygon.size(); ++i) {
    const Vec3 a = polygon[i - 1] - polygon[0], b = polygon[i] - polygon[0];
    const double part = normal.dot(a.cross(b));
    moment += part * (a + b) / 3.0;
    area += part;
  }
  return polygon[0] + moment / area;
}

Plane plane_of(std::span<const Vec3> polygon) {
  const Vec3 normal = area_vector(polygon).normalized();
  return {normal, normal.dot(centroid(polygon))};
}

double diameter_m(std::span<const Vec3> polygon) {
  double longest = 0.0;
  for (std::size_t i = 0; i < polygon.size(); ++i)
    for (std::size_t j = i + 1; j < polygon.size(); ++j)
      longest = std::max(longest, (polygon[i] - polygon[j]).norm());
  return longest;
}

bool is_convex(std::span<const Vec3> polygon, double tolerance_m) {
  const Vec3 normal = area_vector(polygon).normalized();
  const std::size_t n = polygon.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3 inward = normal.cross(polygon[(i + 1) % n] - polygon[i]).normalized();
    for (const Vec3& v : polygon)
      if (inward.dot(v - polygon[i]) < -tolerance_m) return false;
  }
  return true;
}

void clip(std::span<const Vec3> polygon, const Plane& plane, double tolerance_m, Polygon& kept) {
  kept.clear();
  const std::size_t n = polygon.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3& a = polygon[i];
    const Vec3& b = polygon[(i + 1) % n];
    const double da = plane.distance_m(a), db = plane.distance_m(b);
    if (da >= -tolerance_m) kept.push_back(a);
    if ((da > tolerance_m && db < -tolerance_m) || (da < -tolerance_m && db > tolerance_m))
      kept.push_back(a + (da / (da - db)) * (b - a));
  }
  bool inside = false;
  for (const Vec3& v : kept) inside |= plane.distance_m(v) > tolerance_m;
  if (!inside || kept.size() < 3) kept.clear();
}

namespace {

// Whether two edges that are no neighbours cross.
bool crosses_itself(const Polygon& outline, const Vec3& normal) {
  const std::size_t n = outline.size();
  const auto side = [&](const Vec3& a, const Vec3& b, const Vec3& p) {
    return normal.dot((b - a).cross(p - a));
  };
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = i + 2; j < n; ++j) {
      if (i == 0 && j == n - 1) continue;
      const Vec3 &a = outline[i], &b = outline[i + 1], &c = outline[j], &d = outline[(j + 1) % n];
      if (side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0) return true;
    }
  return false;
}

std::vector<Polygon> triangulate(const Polygon& outline) {
  const Vec3 normal = area_vector(outline).normalized();
  if (crosses_itself(outline, normal)) return {};
  const double tolerance = 1e-12 * diameter_m(outline);
  std::vector<std::size_t> ring(outline.size());
  for (std::size_t i = 0; i < ring.size(); ++i) ring[i] = i;
  std::vector<Polygon> triangles;
  const auto height = [&](const Vec3& a, const Vec3& b, const Vec3& p) {
    return normal.cross(b - a).normalized().dot(p - a);
  };
  while (ring.size() > 3) {
    bool found = false;
    for (std::size_t k = 0; k < ring.size() && !found; ++k) {
      const std::size_t ia = ring[(k + ring.size() - 1) % ring.size()], ib = ring[k],
                        ic = ring[(k + 1) % ring.size()];
      const Vec3 &a = outline[ia], &b = outline[ib], &c = outline[ic];
      if (height(a, b, c) <= tolerance) continue;
      bool empty = true;
      for (std::size_t i : ring) {
        if (i == ia || i == ib || i == ic) continue;
        const Vec3& p = outline[i];
        empty &= !(height(a, b, p) > -tolerance && height(b, c, p) > -tolerance &&
                   height(c, a, p) > -tolerance);
      }
      if (!empty) continue;
      triangles.push_back({a, b, c});
      ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(k));
      found = true;
    }
    if (!found) return {};
  }
  triangles.push_back({outline[ring[0]], outline[ring[1]], outline[ring[2]]});
  return triangles;
}

// What is left of convex pieces when a convex hole is cut out: each side of the hole splits off the
// part beyond it.
std::vector<Polygon> subtract(const std::vector<Polygon>& pieces, const Polygon& hole,
                              const Vec3& normal, double tolerance) {
  std::vector<Polygon> rest;
  Polygon outside, inside;
  for (Polygon piece : pieces) {
    for (std::size_t i = 0; i < hole.size() && !piece.empty(); ++i) {
      const Vec3 outward = (hole[(i + 1) % hole.size()] - hole[i]).cross(normal).normalized();
      const Plane side{outward, outward.dot(hole[i])};
      clip(piece, side, tolerance, outside);
      if (!outside.empty()) rest.push_back(outside);
      clip(piece, Plane{-side.normal, -side.offset_m}, tolerance, inside);
      piece = inside;
    }
  }
  return rest;
}

}  // namespace

std::vector<Polygon> convex_pieces(const Polygon& outline, const std::vector<Polygon>& holes) {
  const double tolerance = 1e-10 * diameter_m(outline);
  const Vec3 normal = area_vector(outline).normalized();
  std::vector<Polygon> pieces =
      is_convex(outline, tolerance) ? std::vector<Polygon>{outline} : triangulate(outline);
  for (Polygon hole : holes) {
    if (area_vector(hole).dot(normal) < 0.0) std::reverse(hole.begin(), hole.end());
    const auto parts = is_convex(hole, tolerance) ? std::vector<Polygon>{hole} : triangulate(hole);
    if (parts.empty()) return {};
    for (const Polygon& part : parts) pieces = subtract(pieces, part, normal, tolerance);
  }
  return pieces;
}

}  // namespace truebox

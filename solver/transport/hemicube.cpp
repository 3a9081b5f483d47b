// SPDX-License-Identifier: BSD-3-Clause
#include "transport/hemicube.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "transport/bounded_exchange.h"
#include "transport/quadrature.h"

namespace truebox {
namespace {

// Factor from an element to the rectangle [0, x] x [0, y] at height 1 above it (Howell B-3).
double corner_of_top(double x, double y) {
  const double a = std::hypot(1.0, x), b = std::hypot(1.0, y);
  return (x / a * std::atan(y / a) + y / b * std::atan(x / b)) / (2.0 * std::numbers::pi);
}

// To [0, y] x [0, z] at distance 1 on a wall that stands on the element's plane (Howell B-4).
double corner_of_side(double y, double z) {
  const double a = std::hypot(1.0, z);
  return (std::atan(y) - std::atan(y / a) / a) / (2.0 * std::numbers::pi);
}

// Factors of the pixels of the top and of one side, rows from the horizon upwards.
struct PixelFactors {
  int resolution;
  std::vector<double> top, side;

  explicit PixelFactors(int n) : resolution(n), top(n * n), side(n * n / 2) {
    const auto at = [n](int k) { return 2.0 * k / n - 1.0; };
    const auto box = [](const auto& corner, double x0, double x1, double y0, double y1) {
      return corner(x1, y1) - corner(x0, y1) - corner(x1, y0) + corner(x0, y0);
    };
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        top[j * n + i] = box(corner_of_top, at(i), at(i + 1), at(j), at(j + 1));
        if (2 * j < n)
          side[j * n + i] = box(corner_of_side, at(i), at(i + 1), 2.0 * j / n, 2.0 * (j + 1) / n);
      }
  }
};

const PixelFactors& pixel_factors(int resolution) {
  static thread_local PixelFactors last(2);
  if (last.resolution != resolution) last = PixelFactors(resolution);
  return last;
}

// Planes through the eye and the edges of a convex polygon; positive inside.
class Outline {
 public:
  Outline(const Vec3& point, std::span<const Vec3> polygon, double side) {
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      const Vec3 inward =
          -side * (polygon[k] - point).cross(polygon[(k + 1) % polygon.size()] - point);
      const double length = inward.norm();
      if (length > 0.0) inward_.push_back(inward / length);
    }
  }

  // Distance of the nearest edge's plane from a point of the cube, negative outside.
  double inside_by(const Vec3& on_cube) const {
    double least = 1e300;
    for (const Vec3& n : inward_) least = std::min(least, n.dot(on_cube));
    return least;
  }

 private:
  std::vector<Vec3> inward_;
};

struct Shadow {
  Outline outline;
  Vec3 depth;  // positive where a ray meets the blocker before the source
};

class Hemicube {
 public:
  Hemicube(const Vec3& point, const Vec3& normal, std::span<const Vec3> source,
           const Plane& source_plane, std::span<const Blocker* const> blockers, int resolution)
      : factors_(pixel_factors(resolution)),
        source_(point, source, 1.0),
        half_diagonal_(std::numbers::sqrt2 / resolution),
        normal_(normal) {
    const double distance = source_plane.distance_m(point);
    for (const Blocker* blocker : blockers) {
      const double to_blocker = blocker->plane.distance_m(point);
      if (to_blocker == 0.0) continue;
      // 1/t_blocker - 1/t_source, linear in the direction.
      shadows_.push_back({Outline(point, blocker->polygon, to_blocker > 0.0 ? 1.0 : -1.0),
                          source_plane.normal / distance - blocker->plane.normal / to_blocker});
    }
    tangent_ = normal.unitOrthogonal();
    bitangent_ = normal.cross(tangent_);
  }

  HemicubeFactor count() {
    const int n = factors_.resolution;
    const auto at = [n](int k) { return (2.0 * k + 1.0) / n - 1.0; };
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i)
        look(normal_ + at(i) * tangent_ + at(j) * bitangent_, factors_.top[j * n + i]);
    const std::array<std::array<Vec3, 2>, 4> sides = {{{tangent_, bitangent_},
                                                       {bitangent_, -tangent_},
                                                       {-tangent_, -bitangent_},
                                                       {-bitangent_, tangent_}}};
    for (const auto& [out, along] : sides)
      for (int j = 0; 2 * j < n; ++j)
        for (int i = 0; i < n; ++i)
          look(out + at(i) * along + (2.0 * j + 1.0) / n * normal_, factors_.side[j * n + i]);
    return result_;
  }

 private:
  void look(const Vec3& pixel, double factor) {
    ++result_.pixels;
    const double inside = source_.inside_by(pixel);
    if (inside < -half_diagonal_) return;
    bool certain = inside > half_diagonal_, hidden = false, surely_hidden = false;
    for (const Shadow& shadow : shadows_) {
      const double in_shadow = shadow.outline.inside_by(pixel);
      if (in_shadow < -half_diagonal_) continue;
      const double before = shadow.depth.dot(pixel);
      const double slack = half_diagonal_ * shadow.depth.norm();
      if (before < -slack) continue;
      if (in_shadow > half_diagonal_ && before > slack)
        surely_hidden = true;
      else
        certain = false;
      hidden |= in_shadow > 0.0 && before > 0.0;
    }
    if (surely_hidden) return;
    if (!certain) result_.aliasing_bound += factor;
    if (inside > 0.0 && !hidden) result_.factor += factor;
  }

  const PixelFactors& factors_;
  Outline source_;
  std::vector<Shadow> shadows_;
  double half_diagonal_;
  Vec3 normal_, tangent_, bitangent_;
  HemicubeFactor result_;
};

}  // namespace

HemicubeFactor hemicube_factor(const Vec3& point, const Vec3& normal, std::span<const Vec3> source,
                               const Plane& source_plane, std::span<const Blocker* const> blockers,
                               int resolution) {
  if (source_plane.distance_m(point) <= 0.0) return {};
  return Hemicube(point, normal, source, source_plane, blockers, resolution).count();
}

HemicubeExchange hemicube_exchange(const PlanarPolygon& i, const PlanarPolygon& j,
                                   std::span<const Blocker* const> blockers, int resolution) {
  Polygon part_i, part_j;
  if (!facing_parts(i, j, part_i, part_j)) return {};
  const PlanarPolygon a(std::move(part_i)), b(std::move(part_j));
  const bool swap = b.radius_m < a.radius_m;
  const PlanarPolygon &receiver = swap ? b : a, &source = swap ? a : b;
  const Polygon& p = receiver.vertices;
  HemicubeExchange result;
  double rough = 0.0;
  for (std::size_t k = 1; k + 1 < p.size(); k += 2) {
    const std::array<Vec3, 4> q = {p[0], p[k], p[k + 1], k + 2 < p.size() ? p[k + 2] : p[0]};
    for (int points : {2, 3}) {
      const GaussRule& rule = gauss_rule(points);
      for (int n = 0; n < points * points; ++n) {
        const double u = rule.nodes[n % points], v = rule.nodes[n / points];
        const Vec3 x = (1 - v) * ((1 - u) * q[0] + u * q[1]) + v * ((1 - u) * q[3] + u * q[2]);
        const Vec3 du = (1 - v) * (q[1] - q[0]) + v * (q[2] - q[3]);
        const Vec3 dv = (1 - u) * (q[3] - q[0]) + u * (q[2] - q[1]);
        const double weight = rule.weights[n % points] * rule.weights[n / points] *
                              receiver.plane.normal.dot(du.cross(dv));
        const auto seen = hemicube_factor(x, receiver.plane.normal, source.vertices, source.plane,
                                          blockers, resolution);
        result.pixels += seen.pixels;
        (points == 2 ? rough : result.exchange_area_m2) += weight * seen.factor;
        if (points == 3) result.aliasing_bound_m2 += weight * seen.aliasing_bound;
      }
    }
  }
  result.error_bound_m2 =
      result.aliasing_bound_m2 + 3.0 * std::abs(result.exchange_area_m2 - rough);
  return result;
}

}  // namespace truebox

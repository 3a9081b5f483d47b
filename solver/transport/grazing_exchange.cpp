// SPDX-License-Identifier: BSD-3-Clause
#include "transport/grazing_exchange.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "transport/polygon_rule.h"

namespace truebox {
namespace {

constexpr int kDeepest = 20;  // a cell of 4^-20 of the receiver is nothing
constexpr int kRough = 5, kFine = 8;

// A bilinear quad of the receiver; a triangle repeats a corner.
using Quad = std::array<Vec3, 4>;

class Integrator {
 public:
  Integrator(const PlanarPolygon& receiver, const PlanarPolygon& source, double tolerance)
      : receiver_(receiver), source_(source) {
    const std::vector<Quad> quads = fan(receiver.vertices);
    double whole = 0.0;
    for (const Quad& quad : quads) whole += gauss(quad, kFine);
    // Cells shrink geometrically towards a corner: all together are some ten times the largest.
    allowed_m2_ = 0.1 * tolerance * whole;
    for (const Quad& quad : quads) result_m2_ += integral(quad, 0);
  }
  double result_m2() const { return std::max(0.0, result_m2_); }

 private:
  static std::vector<Quad> fan(const Polygon& p) {
    std::vector<Quad> quads;
    for (std::size_t k = 1; k + 1 < p.size(); k += 2)
      quads.push_back({p[0], p[k], p[k + 1], k + 2 < p.size() ? p[k + 2] : p[0]});
    return quads;
  }

  double gauss(const Quad& q, int points) const {
    const Polygon cell(q.begin(), q.end());
    const double area_m2 = area_vector(cell).norm();
    if (area_m2 == 0.0) return 0.0;
    double sum = 0.0;
    for_each_gauss_point(cell, points, [&](const Vec3& x, double weight) {
      sum += weight * grazing_factor(x, receiver_.plane.normal, source_);
    });
    return area_m2 * sum;
  }

  double integral(const Quad& q, int depth) const {
    const double fine = gauss(q, kFine);
    if (depth == kDeepest || std::abs(fine - gauss(q, kRough)) <= allowed_m2_) return fine;
    const Vec3 low = 0.5 * (q[0] + q[1]), right = 0.5 * (q[1] + q[2]);
    const Vec3 high = 0.5 * (q[2] + q[3]), left = 0.5 * (q[3] + q[0]);
    const Vec3 middle = 0.5 * (low + high);
    return integral({q[0], low, middle, left}, depth + 1) +
           integral({low, q[1], right, middle}, depth + 1) +
           integral({middle, right, q[2], high}, depth + 1) +
           integral({left, middle, high, q[3]}, depth + 1);
  }

  const PlanarPolygon& receiver_;
  const PlanarPolygon& source_;
  double allowed_m2_ = 0.0, result_m2_ = 0.0;
};

double highest_m(const PlanarPolygon& polygon, const Plane& plane) {
  double highest = 0.0;
  for (const Vec3& v : polygon.vertices) highest = std::max(highest, std::abs(plane.distance_m(v)));
  return highest;
}

}  // namespace

double grazing_factor(const Vec3& point, const Vec3& normal, const PlanarPolygon& source) {
  const Vec3& m = source.plane.normal;
  const Polygon& p = source.vertices;
  const double h = m.dot(point - p[0]), h2 = h * h, along = normal.dot(m);
  if (h <= 0.0) return 0.0;
  const Vec3 tilt = normal - along * m;
  double c = 0.0, t = 0.0;
  bool foot_inside = true;
  for (std::size_t k = 0; k < p.size(); ++k) {
    const Vec3 &start = p[k], edge = p[k + 1 == p.size() ? 0 : k + 1] - start;
    const double length = edge.norm();
    if (length == 0.0) continue;
    const Vec3 u = edge / length, a = start - point;
    // In the source's plane, from the foot: along the edge from s to e, past it at distance d.
    const double s = a.dot(u), e = s + length, d = m.dot(a.cross(u)), flat = std::abs(d);
    foot_inside &= d >= 0.0;
    const double rho = std::sqrt(d * d + h2);
    const double angle = std::atan2(length * rho, rho * rho + s * e);
    // atan(x / rho) - atan(x / flat), the angle that the height takes away.
    const auto less = [&](double x) {
      return -std::atan2(x * h2, (rho + flat) * (rho * flat + x * x));
    };
    const double change = -h2 / (rho * (rho + flat)) * angle + less(e) - less(s);
    c += d >= 0.0 ? change : -change;
    t -= h * tilt.dot(u.cross(m)) / rho * angle;
  }
  if (foot_inside) c += 2.0 * std::numbers::pi;
  return std::max(0.0, (t - along * c) / (2.0 * std::numbers::pi));
}

double grazing_exchange_m2(const PlanarPolygon& receiver, const PlanarPolygon& source,
                           double relative_tolerance) {
  return Integrator(receiver, source, relative_tolerance).result_m2();
}

double relative_height(const PlanarPolygon& i, const PlanarPolygon& j) {
  const double reach = (i.centroid - j.centroid).norm() + i.radius_m + j.radius_m;
  return std::max(highest_m(i, j.plane), highest_m(j, i.plane)) / reach;
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "transport/form_factor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "transport/bounded_exchange.h"
#include "transport/grazing_exchange.h"
#include "transport/polygon_rule.h"
#include "transport/quadrature.h"

namespace truebox {
namespace {

constexpr double kHorizonTolerance = 1e-13;  // of the polygon's size: rounding of its vertices
constexpr double kParallel = 1e-15;          // sine between lines that are parallel to rounding

double contour_sum(const Vec3& point, const Vec3& normal, std::span<const Vec3> polygon) {
  double sum = 0.0;
  const Vec3* previous = &polygon.back();
  Vec3 a = *previous - point;
  for (const Vec3& vertex : polygon) {
    const Vec3 b = vertex - point;
    // a x b = a x (b - a), and the edge itself keeps its digits however far the polygon is.
    const Vec3 c = a.cross(vertex - *previous);
    const double sine = c.norm();
    if (sine > 0.0) sum += std::atan2(sine, a.dot(b)) * normal.dot(c) / sine;
    a = b;
    previous = &vertex;
  }
  return std::max(0.0, -sum / (2.0 * std::numbers::pi));
}

double radius_about(std::span<const Vec3> polygon, const Vec3& centre) {
  double radius = 0.0;
  for (const Vec3& v : polygon) radius = std::max(radius, (v - centre).norm());
  return radius;
}

double distance_to_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 along = b - a;
  const double t = std::clamp(along.dot(p - a) / along.squaredNorm(), 0.0, 1.0);
  return (p - a - t * along).norm();
}

// Gauss points needed when the nearest singularity lies `distance` from the centre of an interval
// of half-length `radius`: the error falls like rho^-2n, rho the Bernstein ellipse through it.
int gauss_points(double radius, double distance, double tolerance) {
  const double x = distance / radius;
  if (x <= 1.02) return kMaxGaussPoints + 1;
  const double rho = x + std::sqrt(x * x - 1.0);
  return std::max(1, static_cast<int>(std::ceil(-0.5 * std::log(0.1 * tolerance) / std::log(rho))));
}

double lambert_quadrature(const PlanarPolygon& receiver, const PlanarPolygon& source, int points) {
  const Vec3& normal = receiver.plane.normal;
  if (points == 1)
    return receiver.area_m2 * contour_sum(receiver.centroid, normal, source.vertices);
  double mean = 0.0;
  for_each_gauss_point(receiver.vertices, points, [&](const Vec3& x, double weight) {
    mean += weight * contour_sum(x, normal, source.vertices);
  });
  return receiver.area_m2 * mean;
}

// integral_0^L ln(|x - (b0 + t u)| / scale) dt in closed form.
double log_integral(const Vec3& x, const Vec3& b0, const Vec3& u, double length, double scale) {
  const Vec3 d = x - b0;
  const double p = d.dot(u);
  const double h2 = std::max(0.0, (d - p * u).squaredNorm());
  const double h = std::sqrt(h2);
  const auto primitive = [&](double t) {
    const double r2 = h2 + t * t;
    const double logarithm = r2 > 0.0 ? 0.5 * t * std::log(r2 / (scale * scale)) : 0.0;
    return logarithm - t + (h > 0.0 ? h * std::atan2(t, h) : 0.0);
  };
  return primitive(length - p) - primitive(-p);
}

// Two edges, and where their lines come closest: the only point, besides the ends of b, about which
// the inner integral is singular. Its complex place along a is meeting_m +- i meeting_distance_m.
struct EdgePair {
  Vec3 a0, a1, b0, b1, u;  // u: unit vector of b
  double length_a, length_b, scale, tolerance;
  double meeting_m = 0.0, meeting_distance_m = std::numeric_limits<double>::infinity();
};

// The inner integral holds pi h, h the distance from the other line, where its foot lies between
// the ends of b: sqrt(c^2 + sin^2 (s - s0)^2) has its branch points at s0 +- i c / sin. Beyond the
// ends pi h cancels.
void find_meeting(EdgePair& e) {
  const Vec3 w = (e.a1 - e.a0) / e.length_a, apart = e.a0 - e.b0, normal = w.cross(e.u);
  const double sine = normal.norm();
  if (sine < kParallel) return;
  const double at = -apart.cross(e.u).dot(normal) / (sine * sine);
  const double distance = std::abs(apart.dot(normal)) / (sine * sine);
  const double foot = apart.dot(e.u) + at * w.dot(e.u);
  if (foot < -distance || foot > e.length_b + distance) return;
  e.meeting_m = at;
  e.meeting_distance_m = distance;
}

// Outer integral over the part [s0, s1] of edge a, halved until Gauss converges; near a singular
// point the halving is geometric, and what is left below 2^-48 of the edge is negligible.
double outer_integral(const EdgePair& e, double s0, double s1, int depth) {
  const Vec3 p0 = e.a0 + s0 * (e.a1 - e.a0), p1 = e.a0 + s1 * (e.a1 - e.a0);
  const Vec3 middle = 0.5 * (p0 + p1);
  const double radius = 0.5 * (p1 - p0).norm();
  const double distance =
      std::min({(middle - e.b0).norm(), (middle - e.b1).norm(),
                std::hypot(0.5 * (s0 + s1) * e.length_a - e.meeting_m, e.meeting_distance_m)});
  int points = gauss_points(radius, distance, e.tolerance);
  if (points > 12 && depth < 48) {
    const double half = 0.5 * (s0 + s1);
    return outer_integral(e, s0, half, depth + 1) + outer_integral(e, half, s1, depth + 1);
  }
  points = std::min(points, 12);
  const GaussRule& rule = gauss_rule(points);
  double sum = 0.0;
  for (int i = 0; i < points; ++i)
    sum += rule.weights[i] *
           log_integral(p0 + rule.nodes[i] * (p1 - p0), e.b0, e.u, e.length_b, e.scale);
  return sum * 2.0 * radius;
}

// `magnitude`, if asked for, is the sum of the terms without their signs.
double double_contour(const PlanarPolygon& first, const PlanarPolygon& second, double tolerance,
                      double* magnitude) {
  const Polygon &i = first.vertices, &j = second.vertices;
  const double scale = std::max((first.centroid - second.centroid).norm(), 1e-300);
  double sum = 0.0;
  for (std::size_t k = 0; k < i.size(); ++k)
    for (std::size_t l = 0; l < j.size(); ++l) {
      EdgePair e{i[k],     i[(k + 1) % i.size()], j[l], j[(l + 1) % j.size()], {}, 0, 0, scale,
                 tolerance};
      e.length_a = (e.a1 - e.a0).norm();
      e.length_b = (e.b1 - e.b0).norm();
      if (e.length_a == 0.0 || e.length_b == 0.0) continue;
      e.u = (e.b1 - e.b0) / e.length_b;
      const double cosine = e.u.dot(e.a1 - e.a0) / e.length_a;
      if (std::abs(cosine) < 1e-15) continue;
      find_meeting(e);
      const double term = cosine * outer_integral(e, 0.0, 1.0, 0);
      sum += term;
      if (magnitude) *magnitude += std::abs(term) / (2.0 * std::numbers::pi);
    }
  return std::max(0.0, sum / (2.0 * std::numbers::pi));
}

double contour_m2(const PlanarPolygon& receiver, const PlanarPolygon& source, double tolerance,
                  double* magnitude) {
  double nearest = std::numeric_limits<double>::infinity();
  const double apart = (receiver.centroid - source.centroid).norm() - source.radius_m;
  if (apart > 10.0 * receiver.radius_m) {
    nearest = apart;  // a lower bound is enough far away
  } else {
    const Polygon& p = source.vertices;
    for (std::size_t k = 0; k < p.size(); ++k)
      nearest =
          std::min(nearest, distance_to_segment(receiver.centroid, p[k], p[(k + 1) % p.size()]));
  }
  const int points = gauss_points(receiver.radius_m, nearest, tolerance);
  if (points > 8) return double_contour(receiver, source, tolerance, magnitude);
  if (magnitude)
    *magnitude +=
        receiver.area_m2 * lambert_terms(receiver.centroid, receiver.plane.normal, source.vertices);
  return lambert_quadrature(receiver, source, points);
}

// Each term carries some twenty roundings (logarithms, square roots, Gauss sums).
constexpr double kRounding = 20.0 * std::numeric_limits<double>::epsilon();
constexpr double kDigitsAskedFor = 1e-6;  // rougher answers do not mind that contours cancel
constexpr double kCancels = 1e-11;
constexpr double kGrazing =
    0.1;  // relative height, and sine of the tilt, of one plane nearly shared

// Both polygons wholly in front of each other. The smaller one receives.
double unoccluded_m2(const PlanarPolygon& i, const PlanarPolygon& j, double tolerance,
                     double* magnitude) {
  const bool swap =
      j.radius_m < i.radius_m || (j.radius_m == i.radius_m && j.centroid.sum() < i.centroid.sum());
  const PlanarPolygon& receiver = swap ? j : i;
  const PlanarPolygon& source = swap ? i : j;
  if (tolerance > kDigitsAskedFor) return contour_m2(receiver, source, tolerance, magnitude);
  double terms = 0.0;
  double result = contour_m2(receiver, source, tolerance, &terms);
  if (kRounding * terms > kCancels * result && i.plane.normal.dot(j.plane.normal) > 0.0 &&
      i.plane.normal.cross(j.plane.normal).norm() < kGrazing) {
    const double height = relative_height(i, j);
    if (height > 0.0 && height < kGrazing) {
      constexpr double kTolerance = 1e-12;
      result = grazing_exchange_m2(receiver, source, std::max(tolerance, kTolerance));
      terms = result * (1.0 / height + kTolerance / kRounding);
    }
  }
  if (magnitude) *magnitude += terms;
  return result;
}

// Bit 0: some of the polygon lies above the plane, bit 1: some below.
int side_of(const PlanarPolygon& polygon, const Plane& plane) {
  const double tolerance =
      kHorizonTolerance * (std::abs(plane.distance_m(polygon.centroid)) + 2.0 * polygon.radius_m);
  int seen = 0;
  for (const Vec3& v : polygon.vertices) {
    const double d = plane.distance_m(v);
    seen |= (d > tolerance ? 1 : 0) | (d < -tolerance ? 2 : 0);
  }
  return seen;
}

double exchange_m2(const PlanarPolygon& i, const PlanarPolygon& j, double tolerance,
                   double* magnitude) {
  const int side_i = side_of(i, j.plane), side_j = side_of(j, i.plane);
  if (!(side_i & 1) || !(side_j & 1)) return 0.0;
  if (side_i != 3 && side_j != 3) return unoccluded_m2(i, j, tolerance, magnitude);
  Polygon part_i, part_j;
  if (!facing_parts(i, j, part_i, part_j)) return 0.0;
  return unoccluded_m2(PlanarPolygon(std::move(part_i)), PlanarPolygon(std::move(part_j)),
                       tolerance, magnitude);
}

}  // namespace

double lambert_terms(const Vec3& point, const Vec3& normal, std::span<const Vec3> polygon) {
  double sum = 0.0;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vec3 a = polygon[k] - point, b = polygon[(k + 1) % polygon.size()] - point;
    const Vec3 c = a.cross(b - a);
    const double sine = c.norm();
    if (sine > 0.0) sum += std::abs(std::atan2(sine, a.dot(b)) * normal.dot(c) / sine);
  }
  return sum / (2.0 * std::numbers::pi);
}

double point_to_polygon(const Vec3& point, const Vec3& normal, std::span<const Vec3> polygon) {
  const Plane horizon{normal, normal.dot(point)};
  bool below = false;
  double reach = 0.0;
  for (const Vec3& v : polygon) {
    below |= horizon.distance_m(v) < 0.0;
    reach = std::max(reach, (v - point).norm());
  }
  if (!below) return contour_sum(point, normal, polygon);
  Polygon above;
  clip(polygon, horizon, kHorizonTolerance * reach, above);
  return above.empty() ? 0.0 : contour_sum(point, normal, above);
}

PlanarPolygon::PlanarPolygon(Polygon polygon)
    : vertices(std::move(polygon)),
      plane(plane_of(vertices)),
      centroid(truebox::centroid(vertices)),
      area_m2(area_vector(vertices).norm()),
      radius_m(radius_about(vertices, centroid)) {}

bool facing_parts(const PlanarPolygon& i, const PlanarPolygon& j, Polygon& part_i,
                  Polygon& part_j) {
  const int side_i = side_of(i, j.plane), side_j = side_of(j, i.plane);
  if (!(side_i & 1) || !(side_j & 1)) return false;
  part_i = i.vertices;
  part_j = j.vertices;
  if (side_i == 3) clip(i.vertices, j.plane, kHorizonTolerance * i.radius_m, part_i);
  if (side_j == 3) clip(j.vertices, i.plane, kHorizonTolerance * j.radius_m, part_j);
  return !part_i.empty() && !part_j.empty();
}

double exchange_area_m2(const PlanarPolygon& i, const PlanarPolygon& j, double relative_tolerance) {
  return exchange_m2(i, j, relative_tolerance, nullptr);
}

BoundedExchange bounded_exchange(const PlanarPolygon& i, const PlanarPolygon& j,
                                 double relative_tolerance) {
  double magnitude = 0.0;
  BoundedExchange result;
  result.exchange_area_m2 = exchange_m2(i, j, relative_tolerance, &magnitude);
  result.error_bound_m2 = relative_tolerance * result.exchange_area_m2 + kRounding * magnitude;
  return result;
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "transport/moment_integrals.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "transport/quadrature.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr int kLeafPoints = 9;                   // above, halving is cheaper
constexpr int kFarPoints = 8;                    // above, points are gathered one by one
constexpr int kCrowdedPoints = kMaxGaussPoints;  // a few 1e-6 of a touching pair's moments

double distance_to_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 along = b - a;
  const double length = along.squaredNorm();
  const double t = length > 0.0 ? std::clamp(along.dot(p - a) / length, 0.0, 1.0) : 0.0;
  return (p - a - t * along).norm();
}

// Between two segments: at an end of one, or where the common perpendicular meets both.
double segment_distance(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  double nearest = std::min({distance_to_segment(a, c, d), distance_to_segment(b, c, d),
                             distance_to_segment(c, a, b), distance_to_segment(d, a, b)});
  const Vec3 e = b - a, f = d - c, across = e.cross(f);
  const double square = across.squaredNorm();
  if (square <= 1e-24 * e.squaredNorm() * f.squaredNorm()) return nearest;
  const double s = (c - a).cross(f).dot(across) / square, t = (c - a).cross(e).dot(across) / square;
  if (s > 0.0 && s < 1.0 && t > 0.0 && t < 1.0)
    nearest = std::min(nearest, std::abs((c - a).dot(across)) / std::sqrt(square));
  return nearest;
}

using Quad = std::array<Vec3, 4>;

double distance_to_quad(const Vec3& p, const Quad& q, const Vec3& normal) {
  bool inside = true;
  double nearest = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 4; ++k) {
    const Vec3 &a = q[k], &b = q[(k + 1) % 4];
    if (normal.dot((b - a).cross(p - a)) >= 0.0) continue;
    inside = false;
    nearest = std::min(nearest, distance_to_segment(p, a, b));
  }
  return inside ? std::abs(normal.dot(p - q[0])) : nearest;
}

double distance_between(const PolynomialElement& a, const PolynomialElement& b) {
  const Quad &p = a.corners(), &q = b.corners();
  double nearest = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 4; ++k) {
    nearest = std::min(
        {nearest, distance_to_quad(p[k], q, b.normal()), distance_to_quad(q[k], p, a.normal())});
    for (int l = 0; l < 4; ++l)
      nearest = std::min(nearest, segment_distance(p[k], p[(k + 1) % 4], q[l], q[(l + 1) % 4]));
  }
  return nearest;
}

struct Sides {
  double u_m, v_m;
};
Sides sides(const Quad& q) {
  return {std::max((q[1] - q[0]).norm(), (q[2] - q[3]).norm()),
          std::max((q[3] - q[0]).norm(), (q[2] - q[1]).norm())};
}

// Gauss points for an interval of the given length whose integrand, a polynomial times a kernel,
// is singular at the given distance: Bernstein's ellipse, one point more for the pole's order.
int points_needed(double length_m, double distance_m, int degree, double tolerance) {
  const double d = 2.0 * distance_m / length_m;
  const double needed =
      1.0 + 0.5 * degree - 0.5 * std::log(tolerance) / std::log(d + std::sqrt(d * d + 1.0));
  return needed < 100.0 ? static_cast<int>(std::ceil(needed)) : 100;
}

double kernel(const Vec3& x, const Vec3& x_normal, const Vec3& y, const Vec3& y_normal) {
  const Vec3 r = y - x;
  const double square = r.squaredNorm();
  return std::max(0.0, x_normal.dot(r)) * std::max(0.0, -y_normal.dot(r)) /
         (std::numbers::pi * square * square);
}

struct Gatherer {
  const Vec3& x;
  const Vec3& normal;
  const PolynomialElement& source;
  double tolerance;
  double* sum;

  void add(double u0, double u1, double v0, double v1, int depth) {
    const Quad q = {source.at(u0, v0), source.at(u1, v0), source.at(u1, v1), source.at(u0, v1)};
    const auto [length_u, length_v] = sides(q);
    const double distance = distance_to_quad(x, q, source.normal());
    const int nu = points_needed(length_u, distance, source.degree(), tolerance);
    const int nv = points_needed(length_v, distance, source.degree(), tolerance);
    if (std::max(nu, nv) > kLeafPoints && depth < 100) {
      if (nu >= nv) {
        add(u0, 0.5 * (u0 + u1), v0, v1, depth + 1);
        add(0.5 * (u0 + u1), u1, v0, v1, depth + 1);
      } else {
        add(u0, u1, v0, 0.5 * (v0 + v1), depth + 1);
        add(u0, u1, 0.5 * (v0 + v1), v1, depth + 1);
      }
      return;
    }
    const int mu = std::min(nu, kLeafPoints), mv = std::min(nv, kLeafPoints);
    const GaussRule &rule_u = gauss_rule(mu), &rule_v = gauss_rule(mv);
    const int count = source.functions();
    double factor_v[kLeafPoints][kMaxFunctions], factor_u[kMaxFunctions];
    for (int k = 0; k < mv; ++k) source.factors_at_v(v0 + rule_v.nodes[k] * (v1 - v0), factor_v[k]);
    for (int l = 0; l < mu; ++l) {
      const double u = u0 + rule_u.nodes[l] * (u1 - u0);
      source.factors_at_u(u, factor_u);
      const double area = rule_u.weights[l] * (u1 - u0) * (v1 - v0) * source.jacobian_m2(u);
      for (int k = 0; k < mv; ++k) {
        const double v = v0 + rule_v.nodes[k] * (v1 - v0);
        const double w =
            area * rule_v.weights[k] * kernel(x, normal, source.at(u, v), source.normal());
        for (int f = 0; f < count; ++f) sum[f] += w * factor_u[f] * factor_v[k][f];
      }
    }
  }
};

struct Rule {
  std::vector<double> nodes, weights;
};

// Gauss on the parts of [0, 1] between the cuts, crowded towards their ends if asked for.
Rule composite_rule(const std::vector<double>& cuts, bool crowded, int points) {
  Rule rule;
  const GaussRule& gauss = gauss_rule(points);
  for (std::size_t c = 1; c < cuts.size(); ++c)
    for (int k = 0; k < points; ++k) {
      const double t = gauss.nodes[k], width = cuts[c] - cuts[c - 1];
      const double s = crowded ? t * t * t * (10.0 + t * (6.0 * t - 15.0)) : t;
      const double slope = crowded ? 30.0 * t * t * (1.0 - t) * (1.0 - t) : 1.0;
      rule.nodes.push_back(cuts[c - 1] + s * width);
      rule.weights.push_back(gauss.weights[k] * slope * width);
    }
  return rule;
}

// Where the corners of `other` stand over `element`, in u or v, if near enough to be felt there;
// before and behind them layers that grow geometrically from the scale on which they are felt.
std::vector<double> cuts_below(const PolynomialElement& element, const PolynomialElement& other,
                               int axis, double reach_m, double layer) {
  std::vector<double> cuts = {0.0, 1.0};
  if (element.is_triangle()) return cuts;
  for (const Vec3& corner : other.corners()) {
    if (distance_to_quad(corner, element.corners(), element.normal()) > reach_m) continue;
    const double foot = element.parameters(corner)[static_cast<std::size_t>(axis)];
    const auto cut = [&](double t) {
      if (t > 1e-6 && t < 1.0 - 1e-6) cuts.push_back(t);
    };
    cut(foot);
    for (double reach = std::max(layer, 1e-6); reach < 0.35; reach *= 6.0)
      cut(foot - reach), cut(foot + reach);
  }
  std::sort(cuts.begin(), cuts.end());
  cuts.erase(std::unique(cuts.begin(), cuts.end(),
                         [](double a, double b) { return std::abs(a - b) < 1e-6; }),
             cuts.end());
  return cuts;
}

// phi_f times weights at a product rule: functions x points; the points themselves.
Eigen::MatrixXd sampled_basis(const PolynomialElement& e, const Rule& rule_u, const Rule& rule_v,
                              std::vector<Vec3>& points) {
  const std::size_t nu = rule_u.nodes.size(), nv = rule_v.nodes.size();
  Eigen::MatrixXd phi(e.functions(), static_cast<Index>(nu * nv));
  points.clear();
  for (std::size_t l = 0; l < nu; ++l)
    for (std::size_t k = 0; k < nv; ++k) {
      const double u = rule_u.nodes[l], v = rule_v.nodes[k];
      const auto column = static_cast<Index>(points.size());
      e.evaluate(u, v, phi.col(column).data());
      phi.col(column) *= rule_u.weights[l] * rule_v.weights[k] * e.jacobian_m2(u);
      points.push_back(e.at(u, v));
    }
  return phi;
}

Eigen::MatrixXd far_moments(const PolynomialElement& i, const PolynomialElement& j,
                            const std::array<int, 4>& points) {
  const std::vector<double> whole = {0.0, 1.0};
  std::vector<Vec3> x, y;
  const Eigen::MatrixXd phi_i = sampled_basis(i, composite_rule(whole, false, points[0]),
                                              composite_rule(whole, false, points[1]), x);
  const Eigen::MatrixXd phi_j = sampled_basis(j, composite_rule(whole, false, points[2]),
                                              composite_rule(whole, false, points[3]), y);
  Eigen::MatrixXd g(static_cast<Index>(x.size()), static_cast<Index>(y.size()));
  for (Index q = 0; q < g.cols(); ++q)
    for (Index p = 0; p < g.rows(); ++p)
      g(p, q) = kernel(x[static_cast<std::size_t>(p)], i.normal(), y[static_cast<std::size_t>(q)],
                       j.normal());
  return phi_i * (g * phi_j.transpose());
}

Eigen::MatrixXd near_moments(const PolynomialElement& receiver, const PolynomialElement& source,
                             double distance, const std::array<int, 2>& needed, double tolerance) {
  const auto [length_u, length_v] = sides(receiver.corners());
  const auto [source_u, source_v] = sides(source.corners());
  double scale = std::min({length_u, length_v, source_u, source_v});
  if (distance > 1e-9 * scale) scale = std::min(scale, distance);
  std::array<Rule, 2> rules;
  for (int axis = 0; axis < 2; ++axis) {
    const bool crowded = needed[static_cast<std::size_t>(axis)] > kCrowdedPoints;
    const double length = axis ? length_v : length_u, reach = distance + length;
    rules[static_cast<std::size_t>(axis)] =
        composite_rule(crowded ? cuts_below(receiver, source, axis, reach, scale / length)
                               : std::vector<double>{0.0, 1.0},
                       crowded, crowded ? kCrowdedPoints : needed[static_cast<std::size_t>(axis)]);
  }
  std::vector<Vec3> points;
  const Eigen::MatrixXd phi = sampled_basis(receiver, rules[0], rules[1], points);
  Eigen::MatrixXd g = Eigen::MatrixXd::Zero(source.functions(), phi.cols());
  for (Index p = 0; p < phi.cols(); ++p)
    add_gathered_moments(points[static_cast<std::size_t>(p)], receiver.normal(), source, tolerance,
                         g.col(p).data());
  return phi * g.transpose();
}

}  // namespace

void add_gathered_moments(const Vec3& point, const Vec3& normal, const PolynomialElement& source,
                          double relative_tolerance, double* sum) {
  if (source.plane_distance_m(point) <= 0.0) return;
  Gatherer{point, normal, source, relative_tolerance, sum}.add(0.0, 1.0, 0.0, 1.0, 0);
}

Eigen::MatrixXd exchange_moments(const PolynomialElement& i, const PolynomialElement& j,
                                 double relative_tolerance) {
  const double distance = distance_between(i, j);
  const Sides si = sides(i.corners()), sj = sides(j.corners());
  const auto needed = [&](double length, int degree) {
    return points_needed(length, distance, degree, relative_tolerance);
  };
  const std::array<int, 4> points = {needed(si.u_m, i.degree()), needed(si.v_m, i.degree()),
                                     needed(sj.u_m, j.degree()), needed(sj.v_m, j.degree())};
  if (*std::max_element(points.begin(), points.end()) <= kFarPoints)
    return far_moments(i, j, points);
  if (i.area_m2() <= j.area_m2())
    return near_moments(i, j, distance, {points[0], points[1]}, relative_tolerance);
  return near_moments(j, i, distance, {points[2], points[3]}, relative_tolerance).transpose();
}

}  // namespace truebox

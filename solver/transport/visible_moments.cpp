// SPDX-License-Identifier: BSD-3-Clause
#include "transport/visible_moments.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "transport/quadrature.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr double kNear = 0.7;      // longest edge : distance of a triangle that one rule serves
constexpr int kMostSplits = 7;     // of a triangle next to the point
constexpr int kMorePoints = 3;     // of a rule, beyond the degree
constexpr int kReceiverParts = 2;  // squared; each with a rule of its own

Plane plane_of(const PolynomialElement& e) { return {e.normal(), e.normal().dot(e.corners()[0])}; }

Polygon polygon_of(const PolynomialElement& e) {
  const auto& c = e.corners();
  return Polygon(c.begin(), c.begin() + (e.is_triangle() ? 3 : 4));
}

struct Gathering {
  const Vec3& point;
  const Vec3& normal;
  const PolynomialElement& source;
  double* sum;
};

// Gauss on the square, collapsed onto the triangle at a.
void add_rule(const Gathering& g, const Vec3& a, const Vec3& b, const Vec3& c) {
  const int points = g.source.degree() + kMorePoints;
  const GaussRule& rule = gauss_rule(points);
  const double twice_m2 = (b - a).cross(c - a).norm();
  double phi[kMaxFunctions];
  for (int l = 0; l < points; ++l)
    for (int k = 0; k < points; ++k) {
      const double u = rule.nodes[l], v = rule.nodes[k];
      const Vec3 y = a + u * ((1.0 - v) * (b - a) + v * (c - a));
      const Vec3 r = y - g.point;
      const double cosines = g.normal.dot(r) * -g.source.normal().dot(r), r2 = r.squaredNorm();
      if (!(cosines > 0.0)) continue;
      const auto [s, t] = g.source.parameters(y);
      g.source.evaluate(s, t, phi);
      const double w =
          rule.weights[l] * rule.weights[k] * u * twice_m2 * cosines / (std::numbers::pi * r2 * r2);
      for (int f = 0; f < g.source.functions(); ++f) g.sum[f] += w * phi[f];
    }
}

void add_triangle(const Gathering& g, const Vec3& a, const Vec3& b, const Vec3& c, int splits) {
  const double longest =
      std::sqrt(std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()}));
  if (splits == 0 || longest <= kNear * ((a + b + c) / 3.0 - g.point).norm())
    return add_rule(g, a, b, c);
  const Vec3 ab = 0.5 * (a + b), bc = 0.5 * (b + c), ca = 0.5 * (c + a);
  add_triangle(g, a, ab, ca, splits - 1);
  add_triangle(g, ab, b, bc, splits - 1);
  add_triangle(g, ca, bc, c, splits - 1);
  add_triangle(g, ab, bc, ca, splits - 1);
}

double farthest_in_front(const Plane& plane, const Polygon& polygon) {
  double farthest = -std::numeric_limits<double>::infinity();
  for (const Vec3& v : polygon) farthest = std::max(farthest, plane.distance_m(v));
  return farthest;
}

double farthest_behind(const Plane& plane, const Polygon& polygon) {
  return farthest_in_front({-plane.normal, -plane.offset_m}, polygon);
}

}  // namespace

bool faces_wholly(const PolynomialElement& a, const PolynomialElement& b) {
  const Polygon of_a = polygon_of(a), of_b = polygon_of(b);
  const double tolerance_m = 1e-9 * std::sqrt(std::max(a.area_m2(), b.area_m2()));
  return farthest_behind(plane_of(a), of_b) <= tolerance_m &&
         farthest_behind(plane_of(b), of_a) <= tolerance_m;
}

VisibleMoments::VisibleMoments(const PatchMesh& mesh, const Scene& scene)
    : tolerance_m_(1e-9 * scene.diameter_m()) {
  for (const Piece& piece : mesh.pieces)
    if (!scene.surfaces[piece.surface].is_opening)
      blockers_.push_back({piece.polygon, piece.plane});
}

std::vector<const Blocker*> VisibleMoments::between(const PolynomialElement& i,
                                                    const PolynomialElement& j) const {
  const Polygon of_i = polygon_of(i), of_j = polygon_of(j);
  Eigen::AlignedBox3d hull;
  for (const Vec3& v : of_i) hull.extend(v);
  for (const Vec3& v : of_j) hull.extend(v);
  std::vector<const Blocker*> found;
  for (const Blocker& b : blockers_) {
    if (farthest_in_front(plane_of(i), b.polygon) <= tolerance_m_ ||
        farthest_in_front(plane_of(j), b.polygon) <= tolerance_m_)
      continue;  // behind one of them
    const auto touches = [&](double (*farthest)(const Plane&, const Polygon&)) {
      return farthest(b.plane, of_i) > tolerance_m_ || farthest(b.plane, of_j) > tolerance_m_;
    };
    if (!touches(farthest_in_front) || !touches(farthest_behind)) continue;  // on one side of it
    Eigen::AlignedBox3d box;
    for (const Vec3& v : b.polygon) box.extend(v);
    if (box.intersects(hull)) found.push_back(&b);
  }
  return found;
}

void VisibleMoments::add_gathered(const Vec3& point, const Vec3& normal,
                                  const PolynomialElement& source,
                                  const std::vector<const Blocker*>& between, double* sum) const {
  const Plane plane = plane_of(source);
  if (plane.distance_m(point) <= tolerance_m_) return;
  thread_local VisibleParts parts;
  thread_local Polygon lit;
  clip(polygon_of(source), {normal, normal.dot(point)}, tolerance_m_, lit);
  if (lit.size() < 3) return;
  std::vector<const Blocker*> blocking;
  for (const Blocker* b : between)
    if (may_block(*b, point, lit, plane, tolerance_m_)) blocking.push_back(b);
  const Gathering gathering{point, normal, source, sum};
  for (const Polygon& part : parts(point, lit, plane, blocking))
    for (std::size_t k = 2; k < part.size(); ++k)
      add_triangle(gathering, part[0], part[k - 1], part[k], kMostSplits);
}

Eigen::MatrixXd VisibleMoments::exchange(const PolynomialElement& i, const PolynomialElement& j,
                                         const std::vector<const Blocker*>& between) const {
  if (i.area_m2() > j.area_m2()) return exchange(j, i, between).transpose();
  const int points = i.degree() + kMorePoints;
  const GaussRule& rule = gauss_rule(points);
  Eigen::MatrixXd moments = Eigen::MatrixXd::Zero(i.functions(), j.functions());
  Eigen::VectorXd gathered(j.functions()), phi(i.functions());
  for (int l = 0; l < points * kReceiverParts; ++l)
    for (int k = 0; k < points * kReceiverParts; ++k) {
      const double u = (l / points + rule.nodes[l % points]) / kReceiverParts;
      const double v = (k / points + rule.nodes[k % points]) / kReceiverParts;
      const double w = rule.weights[l % points] * rule.weights[k % points] * i.jacobian_m2(u) /
                       (kReceiverParts * kReceiverParts);
      gathered.setZero();
      add_gathered(i.at(u, v), i.normal(), j, between, gathered.data());
      i.evaluate(u, v, phi.data());
      moments.noalias() += w * phi * gathered.transpose();
    }
  return moments;
}

}  // namespace truebox

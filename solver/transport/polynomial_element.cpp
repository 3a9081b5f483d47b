// SPDX-License-Identifier: BSD-3-Clause
#include "transport/polynomial_element.h"

#include <cmath>

#include "transport/legendre.h"

namespace truebox {
namespace {

// Jacobi polynomial P_n^(0, beta)(x) by its recurrence (Abramowitz & Stegun 22.7.1).
double jacobi(int n, double beta, double x) {
  double before = 1.0, now = 0.5 * ((beta + 2.0) * x - beta);
  if (n == 0) return before;
  for (int k = 1; k < n; ++k) {
    const double c = 2.0 * k + beta;
    const double next = ((c + 1.0) * ((c + 2.0) * c * x - beta * beta) * now -
                         2.0 * k * (k + beta) * (c + 2.0) * before) /
                        (2.0 * (k + 1.0) * (k + 1.0 + beta) * c);
    before = now;
    now = next;
  }
  return now;
}

}  // namespace

PolynomialElement::PolynomialElement(const Polygon& vertices, int degree)
    : is_triangle_(vertices.size() == 3), degree_(degree) {
  const Vec3 area = area_vector(vertices);
  area_m2_ = area.norm();
  normal_ = area / area_m2_;
  corners_ = {vertices[0], vertices[1], vertices[2], is_triangle_ ? vertices[0] : vertices[3]};
  for (int a = 0; a <= degree; ++a)
    for (int b = 0; b <= (is_triangle_ ? degree - a : degree); ++b) order_.push_back({a, b});
}

bool PolynomialElement::has_at_degree(int f, int degree) const {
  const auto [a, b] = order_[static_cast<std::size_t>(f)];
  return is_triangle_ ? a + b <= degree : a <= degree && b <= degree;
}

Vec3 PolynomialElement::at(double u, double v) const {
  const auto& q = corners_;
  return (1 - v) * ((1 - u) * q[0] + u * q[1]) + v * ((1 - u) * q[3] + u * q[2]);
}

std::array<double, 2> PolynomialElement::parameters(const Vec3& point) const {
  const Vec3 e = corners_[1] - corners_[0];
  const Vec3 f = (is_triangle_ ? corners_[2] : corners_[3]) - corners_[0];
  const Vec3 d = point - corners_[0];
  const double s = normal_.dot(d.cross(f)) / normal_.dot(e.cross(f));
  const double t = normal_.dot(e.cross(d)) / normal_.dot(e.cross(f));
  if (!is_triangle_) return {s, t};
  return {s + t, s + t > 0.0 ? t / (s + t) : 0.0};
}

void PolynomialElement::factors_at_u(double u, double* x) const {
  double power = 1.0, phi[kMaxDegree + 1];
  if (!is_triangle_) legendre(u, degree_, phi);
  std::size_t f = 0;
  for (int a = 0; a <= degree_; ++a, power *= u)
    for (; f < order_.size() && order_[f][0] == a; ++f) {
      const int b = order_[f][1];
      // int u^(2a+1) P_b^2 du = 1 / (2 (a + b + 1)); the area is 2 A u du dv.
      x[f] = is_triangle_ ? power * jacobi(b, 2.0 * a + 1.0, 2.0 * u - 1.0) *
                                std::sqrt((a + b + 1.0) / area_m2_)
                          : phi[b] / std::sqrt(area_m2_);
    }
}

void PolynomialElement::factors_at_v(double v, double* y) const {
  double phi[kMaxDegree + 1];
  legendre(v, degree_, phi);
  for (std::size_t f = 0; f < order_.size(); ++f) y[f] = phi[order_[f][0]];
}

void PolynomialElement::evaluate(double u, double v, double* values) const {
  double y[kMaxFunctions];
  factors_at_u(u, values);
  factors_at_v(v, y);
  for (int f = 0; f < functions(); ++f) values[f] *= y[f];
}

std::vector<PolynomialElement> polynomial_elements(const Polygon& polygon, int degree) {
  const double size = diameter_m(polygon);
  if (polygon.size() == 3 ||
      (polygon.size() == 4 &&
       (polygon[0] + polygon[2] - polygon[1] - polygon[3]).norm() < 1e-9 * size))
    return {PolynomialElement(polygon, degree)};
  std::vector<PolynomialElement> fan;
  for (std::size_t k = 2; k < polygon.size(); ++k)
    fan.emplace_back(Polygon{polygon[0], polygon[k - 1], polygon[k]}, degree);
  return fan;
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <vector>

#include "scene/polygon.h"

namespace truebox {

inline constexpr int kMaxElementDegree = 6;
inline constexpr int kMaxFunctions = (kMaxElementDegree + 1) * (kMaxElementDegree + 1);

/// A parallelogram or triangle with polynomials that are orthonormal over its area (1/m), each a
/// product X_f(u) Y_f(v) of the parameters in [0, 1]^2: Legendre in u times Legendre in v, each up
/// to `degree`; on a triangle, whose corner 0 is the edge u = 0, polynomials of total degree up to
/// `degree`. Source: Dubiner (1991).
class PolynomialElement {
 public:
  /// Three vertices, or four of a parallelogram.
  PolynomialElement(const Polygon& vertices, int degree);

  int degree() const { return degree_; }
  int functions() const { return static_cast<int>(order_.size()); }
  bool is_triangle() const { return is_triangle_; }
  /// Of function f: whether a basis of this degree has it.
  bool has_at_degree(int f, int degree) const;

  const std::array<Vec3, 4>& corners() const { return corners_; }
  const Vec3& normal() const { return normal_; }
  double area_m2() const { return area_m2_; }
  double plane_distance_m(const Vec3& x) const { return normal_.dot(x - corners_[0]); }

  Vec3 at(double u, double v) const;
  /// dA / (du dv), m^2.
  double jacobian_m2(double u) const { return is_triangle_ ? 2.0 * area_m2_ * u : area_m2_; }
  /// Parameters of a point of the plane; a parallelogram's may lie outside [0, 1].
  std::array<double, 2> parameters(const Vec3& point) const;
  /// The factors of every function at u and at v.
  void factors_at_u(double u, double* x) const;
  void factors_at_v(double v, double* y) const;
  void evaluate(double u, double v, double* values) const;

 private:
  std::array<Vec3, 4> corners_;
  Vec3 normal_;
  double area_m2_ = 0.0;
  bool is_triangle_ = false;
  int degree_ = 0;
  std::vector<std::array<int, 2>> order_;  // of each function: in v, in u
};

/// The elements of a convex polygon: itself if it is a triangle or a parallelogram (to 1e-9 of its
/// size), else a fan of triangles.
std::vector<PolynomialElement> polynomial_elements(const Polygon& polygon, int degree);

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "hierarchy/kernel_fit.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "transport/legendre.h"
#include "transport/many_targets.h"
#include "transport/quadrature.h"

namespace truebox {
namespace {

constexpr int kN = 16;

// The 4 x 4 rule on [-1, 1]^2 and the basis at its points.
struct Rule {
  float s[kN], t[kN];
  float value[kN][kN];     // point x term
  float weighted[kN][kN];  // the same times the point's weight
};

const Rule& rule() {
  static const Rule made = [] {
    Rule r{};
    const GaussRule& gauss = gauss_rule(4);
    for (std::size_t k = 0; k < kN; ++k) {
      const double x = gauss.nodes[k % 4], y = gauss.nodes[k / 4];
      r.s[k] = static_cast<float>(2.0 * x - 1.0);
      r.t[k] = static_cast<float>(2.0 * y - 1.0);
      double of_x[4], of_y[4];
      legendre(x, 3, of_x);
      legendre(y, 3, of_y);
      for (std::size_t l = 0; l < kN; ++l) {
        const double value = of_x[kDegreesOfTerm[l][0]] * of_y[kDegreesOfTerm[l][1]];
        r.value[k][l] = static_cast<float>(value);
        r.weighted[k][l] = static_cast<float>(value * gauss.weights[k % 4] * gauss.weights[k / 4]);
      }
    }
    return r;
  }();
  return made;
}

// Points of a rectangle, coordinate by coordinate, seen from `origin`.
struct Points {
  float x[kN], y[kN], z[kN], nx, ny, nz;
};

Points points_of(const GroupFrame& frame, const Vec3& normal, const Vec3& origin) {
  const Eigen::Vector3f c = (frame.centre - origin).cast<float>(), u = frame.half_u.cast<float>(),
                        v = frame.half_v.cast<float>(), n = normal.cast<float>();
  const Rule& r = rule();
  Points points;
  for (int k = 0; k < kN; ++k) {
    points.x[k] = c.x() + r.s[k] * u.x() + r.t[k] * v.x();
    points.y[k] = c.y() + r.s[k] * u.y() + r.t[k] * v.y();
    points.z[k] = c.z() + r.s[k] * u.z() + r.t[k] * v.z();
  }
  points.nx = n.x(), points.ny = n.y(), points.nz = n.z();
  return points;
}

TRUEBOX_MANY_TARGETS void project(const Points& a, const Points& b, const Rule& r,
                                  float (*coefficient)[kN]) {
  float half[kN][kN] = {};  // points of a x terms of b
  for (int i = 0; i < kN; ++i) {
    float kernel[kN];
    for (int j = 0; j < kN; ++j) {
      const float rx = b.x[j] - a.x[i], ry = b.y[j] - a.y[i], rz = b.z[j] - a.z[i];
      const float ca = a.nx * rx + a.ny * ry + a.nz * rz;
      const float cb = -(b.nx * rx + b.ny * ry + b.nz * rz);
      const float r2 = rx * rx + ry * ry + rz * rz + 1e-30f;
      kernel[j] = (ca > 0.0f ? ca : 0.0f) * (cb > 0.0f ? cb : 0.0f) / (r2 * r2);
    }
    for (int j = 0; j < kN; ++j)
      for (int l = 0; l < kN; ++l) half[i][l] += kernel[j] * r.weighted[j][l];
  }
  constexpr float kInversePi = std::numbers::inv_pi_v<float>;
  for (int k = 0; k < kN; ++k) {
    float row[kN] = {};
    for (int i = 0; i < kN; ++i)
      for (int l = 0; l < kN; ++l) row[l] += r.weighted[i][k] * half[i][l];
    for (int l = 0; l < kN; ++l) coefficient[k][l] = kInversePi * row[l];
  }
}

// The basis at a grid of 4 x 4 points with the corners in it, where polynomials dip first: term x
// point.
struct CornerRule {
  float value[kN][kN];
};

const CornerRule& corner_rule() {
  static const CornerRule made = [] {
    CornerRule r{};
    for (std::size_t k = 0; k < kN; ++k) {
      double of_x[4], of_y[4];
      legendre(static_cast<double>(k % 4) / 3.0, 3, of_x);
      legendre(static_cast<double>(k / 4) / 3.0, 3, of_y);
      for (std::size_t l = 0; l < kN; ++l)
        r.value[l][k] = static_cast<float>(of_x[kDegreesOfTerm[l][0]] * of_y[kDegreesOfTerm[l][1]]);
    }
    return r;
  }();
  return made;
}

// The lowest value at the points of the rule on either side.
TRUEBOX_MANY_TARGETS float lowest(const float (*coefficient)[kN], int terms, const CornerRule& r) {
  float least[kN];
  for (int j = 0; j < kN; ++j) least[j] = coefficient[0][0];
  for (int i = 0; i < kN; ++i) {
    float of_b[kN] = {}, value[kN] = {};
    for (int k = 0; k < terms; ++k)
      for (int l = 0; l < kN; ++l) of_b[l] += r.value[k][i] * coefficient[k][l];
    for (int l = 0; l < terms; ++l)
      for (int j = 0; j < kN; ++j) value[j] += of_b[l] * r.value[l][j];
    for (int j = 0; j < kN; ++j) least[j] = value[j] < least[j] ? value[j] : least[j];
  }
  float all = least[0];
  for (int j = 1; j < kN; ++j) all = std::min(all, least[j]);
  return all;
}

constexpr int degree_of(int term) {
  return kDegreesOfTerm[static_cast<std::size_t>(term)][0] +
         kDegreesOfTerm[static_cast<std::size_t>(term)][1];
}

// What lies beyond the last degree falls from it as it fell to it.
double continued(double last, double before) { return last < before ? last * last / before : last; }

// Root of the sum of squares of what `kept` of the four degrees leaves out; shells are squares.
double left_out(const std::array<double, 7>& shell, int kept) {
  double sum = 0.0;
  for (int d = kept + 1; d < 7; ++d) sum += shell[static_cast<std::size_t>(d)];
  const double tail = continued(std::sqrt(shell[3]), std::sqrt(shell[2]));
  return kept < kMaxLinkDegree ? std::sqrt(sum) : std::hypot(std::sqrt(sum), tail);
}

}  // namespace

double KernelFit::damping(int degree) const {
  const double mean = static_cast<double>(coefficient_per_m2[0][0]);
  const auto least =
      static_cast<double>(lowest(coefficient_per_m2, terms_of(degree), corner_rule()));
  return least < 0.0 ? std::max(0.0, mean / (mean - least)) : 1.0;
}

KernelFit fit_kernel(const GroupFrame& a, const Vec3& normal_a, const GroupFrame& b,
                     const Vec3& normal_b) {
  KernelFit fit;
  project(points_of(a, normal_a, a.centre), points_of(b, normal_b, a.centre), rule(),
          fit.coefficient_per_m2);
  std::array<double, 7> both{}, of_a{}, of_b{};  // squares, by the larger degree
  for (int k = 0; k < kN; ++k)
    for (int l = 0; l < kN; ++l) {
      const double square = std::pow(static_cast<double>(fit.coefficient_per_m2[k][l]), 2);
      both[static_cast<std::size_t>(std::max(degree_of(k), degree_of(l)))] += square;
      if (l == 0) of_a[static_cast<std::size_t>(degree_of(k))] += square;
      if (k == 0) of_b[static_cast<std::size_t>(degree_of(l))] += square;
    }
  for (int d = 0; d <= kMaxLinkDegree; ++d)
    fit.of_degree[static_cast<std::size_t>(d)] = {static_cast<double>(fit.coefficient_per_m2[0][0]),
                                                  left_out(both, d), left_out(of_a, d),
                                                  left_out(of_b, d)};
  return fit;
}

}  // namespace truebox

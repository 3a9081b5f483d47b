// SPDX-License-Identifier: BSD-3-Clause
#include "transport/pair_kernel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "transport/quadrature.h"

namespace truebox {
namespace {

constexpr int kOrders[] = {2, 3, 4};

// x from which n points reach the tolerance: rho^-2n = tolerance / 10, x = (rho + 1/rho) / 2.
double least_ratio(int points, double tolerance) {
  const double rho = std::exp(-0.5 * std::log(0.1 * tolerance) / points);
  return 0.5 * (rho + 1.0 / rho);
}

}  // namespace

void PairKernel::Rule::add(const PlanarPolygon& patch, int order) {
  const GaussRule& rule = gauss_rule(order);
  const Polygon& p = patch.vertices;
  for (std::size_t k = 1; k + 1 < p.size(); k += 2) {
    const std::array<Vec3, 4> q = {p[0], p[k], p[k + 1], k + 2 < p.size() ? p[k + 2] : p[0]};
    for (int j = 0; j < order; ++j)
      for (int i = 0; i < order; ++i) {
        const double u = rule.nodes[i], v = rule.nodes[j];
        const Vec3 at = (1 - v) * ((1 - u) * q[0] + u * q[1]) + v * ((1 - u) * q[3] + u * q[2]);
        const Vec3 du = (1 - v) * (q[1] - q[0]) + v * (q[2] - q[3]);
        const Vec3 dv = (1 - u) * (q[3] - q[0]) + u * (q[2] - q[1]);
        x.push_back(at.x());
        y.push_back(at.y());
        z.push_back(at.z());
        weight.push_back(rule.weights[i] * rule.weights[j] * patch.plane.normal.dot(du.cross(dv)));
      }
  }
  first.push_back(static_cast<std::uint32_t>(x.size()));
}

PairKernel::PairKernel(const std::vector<PlanarPolygon>& patches, double relative_tolerance)
    : patches_(patches), tolerance_(relative_tolerance) {
  for (int order : kOrders) {
    Rule& rule = rules_.emplace_back();
    rule.least_ratio = least_ratio(order, relative_tolerance);
    rule.first.push_back(0);
    for (const PlanarPolygon& patch : patches) rule.add(patch, order);
  }
}

double PairKernel::product_rule(const Points& i, const Vec3& normal_i, const Points& j,
                                const Vec3& normal_j) {
  double sum = 0.0;
  for (std::uint32_t a = 0; a < i.count; ++a) {
    double inner = 0.0;
    for (std::uint32_t b = 0; b < j.count; ++b) {
      const double dx = j.x[b] - i.x[a], dy = j.y[b] - i.y[a], dz = j.z[b] - i.z[a];
      const double cos_i = normal_i.x() * dx + normal_i.y() * dy + normal_i.z() * dz;
      const double cos_j = normal_j.x() * dx + normal_j.y() * dy + normal_j.z() * dz;
      const double r2 = dx * dx + dy * dy + dz * dz;
      inner += j.weight_m2[b] * cos_i * cos_j / (r2 * r2);
    }
    sum += i.weight_m2[a] * inner;
  }
  return -sum / std::numbers::pi;
}

bool PairKernel::face_wholly(std::uint32_t i, std::uint32_t j) const {
  const auto in_front = [](const PlanarPolygon& polygon, const Plane& plane) {
    return std::all_of(polygon.vertices.begin(), polygon.vertices.end(),
                       [&](const Vec3& v) { return plane.distance_m(v) >= 0.0; });
  };
  return in_front(patches_[i], patches_[j].plane) && in_front(patches_[j], patches_[i].plane);
}

double PairKernel::exchange_area_m2(std::uint32_t i, std::uint32_t j) const {
  if (j < i) std::swap(i, j);  // the same sums in the same order, whoever is named first
  const PlanarPolygon &a = patches_[i], &b = patches_[j];
  const double large = std::max(a.radius_m, b.radius_m), small = std::min(a.radius_m, b.radius_m);
  const double d2 = (a.centroid - b.centroid).squaredNorm();
  for (const Rule& rule : rules_) {
    const double reach = rule.least_ratio * large + small;
    if (d2 < reach * reach) continue;
    if (!face_wholly(i, j)) break;
    return product_rule(rule.points(i), a.plane.normal, rule.points(j), b.plane.normal);
  }
  return truebox::exchange_area_m2(a, b, tolerance_);
}

std::vector<PlanarPolygon> planar_polygons(const PatchMesh& mesh) {
  std::vector<PlanarPolygon> polygons;
  polygons.reserve(mesh.size());
  Polygon polygon;
  for (const Patch& patch : mesh.patches) {
    mesh.polygon_of(patch, polygon);
    polygons.emplace_back(polygon);
  }
  return polygons;
}

}  // namespace truebox

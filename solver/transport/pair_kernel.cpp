// SPDX-License-Identifier: BSD-3-Clause
#include "transport/pair_kernel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "transport/many_targets.h"
#include "transport/quadrature.h"

namespace truebox {
namespace {

constexpr std::size_t kLanes = 8;
// Eight doubles at once, in whatever registers the machine has. No product is fused with a sum
// (-ffp-contract=off), so every machine finds the same bits.
using Eight [[gnu::vector_size(64)]] = double;

// x from which n points reach the tolerance: rho^-2n = tolerance / 10, x = (rho + 1/rho) / 2.
double least_ratio(int points, double tolerance) {
  const double rho = std::exp(-0.5 * std::log(0.1 * tolerance) / points);
  return 0.5 * (rho + 1.0 / rho);
}

// Calls visit(point, weight) for the nodes of a patch.
template <class Visit>
void for_each_point(const PlanarPolygon& patch, int order, const Visit& visit) {
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
        visit(at, rule.weights[i] * rule.weights[j] * patch.plane.normal.dot(du.cross(dv)));
      }
  }
}

// One end of a batch of pairs: a patch for all lanes (step 0), or neighbours in a run (step 1).
struct BatchEnd {
  PatchPoints points;
  const double *normal_x, *normal_y, *normal_z;
};

template <bool kRun>
[[gnu::always_inline]] inline Eight load(const double* at) {
  Eight value;
  if constexpr (kRun)
    __builtin_memcpy(&value, at, sizeof(value));
  else
    value = *at - Eight{};
  return value;
}

// As product_rule, lane by lane.
template <bool kFirstRuns>
[[gnu::always_inline]] inline void product_rules(const BatchEnd& first, const BatchEnd& second,
                                                 double* result) {
  constexpr bool kSecondRuns = !kFirstRuns;
  const Eight nx = load<kFirstRuns>(first.normal_x), ny = load<kFirstRuns>(first.normal_y),
              nz = load<kFirstRuns>(first.normal_z);
  const Eight mx = load<kSecondRuns>(second.normal_x), my = load<kSecondRuns>(second.normal_y),
              mz = load<kSecondRuns>(second.normal_z);
  const PatchPoints &p = first.points, &q = second.points;
  Eight sum = {};
  for (std::uint32_t a = 0; a < p.count; ++a) {
    const Eight x = load<kFirstRuns>(p.x + a * p.stride), y = load<kFirstRuns>(p.y + a * p.stride),
                z = load<kFirstRuns>(p.z + a * p.stride);
    Eight inner = {};
    for (std::uint32_t b = 0; b < q.count; ++b) {
      const Eight dx = load<kSecondRuns>(q.x + b * q.stride) - x;
      const Eight dy = load<kSecondRuns>(q.y + b * q.stride) - y;
      const Eight dz = load<kSecondRuns>(q.z + b * q.stride) - z;
      const Eight cos_first = nx * dx + ny * dy + nz * dz;
      const Eight cos_second = mx * dx + my * dy + mz * dz;
      const Eight r2 = dx * dx + dy * dy + dz * dz;
      inner += load<kSecondRuns>(q.weight_m2 + b * q.stride) * cos_first * cos_second / (r2 * r2);
    }
    sum += load<kFirstRuns>(p.weight_m2 + a * p.stride) * inner;
  }
  sum = -sum / std::numbers::pi;
  __builtin_memcpy(result, &sum, sizeof(sum));
}

TRUEBOX_MANY_TARGETS void product_rules_to_run(const BatchEnd& patch, const BatchEnd& run,
                                               double* result) {
  product_rules<false>(patch, run, result);
}

TRUEBOX_MANY_TARGETS void product_rules_from_run(const BatchEnd& run, const BatchEnd& patch,
                                                 double* result) {
  product_rules<true>(run, patch, result);
}

}  // namespace

PatchPoints PatchPointBuffer::fill(const PlanarPolygon& patch, int order) {
  x_.clear();
  y_.clear();
  z_.clear();
  weight_.clear();
  for_each_point(patch, order, [&](const Vec3& at, double weight) {
    x_.push_back(at.x());
    y_.push_back(at.y());
    z_.push_back(at.z());
    weight_.push_back(weight);
  });
  return {x_.data(),      y_.data(), z_.data(),
          weight_.data(), 1,         static_cast<std::uint32_t>(x_.size())};
}

PairKernel::PairKernel(const std::vector<PlanarPolygon>& patches,
                       std::span<const std::uint32_t> order, double relative_tolerance,
                       double tolerance_m)
    : patches_(patches),
      order_(order.begin(), order.end()),
      position_of_(patches.size()),
      tolerance_(relative_tolerance),
      tolerance_m_(tolerance_m),
      stride_(patches.size() + kLanes),
      is_simple_(patches.size()),
      buffer_of_(patches.size()) {
  for (int points = kLeastOrder; points < kLeastOrder + kOrders; ++points) {
    Rule& rule = rules_.emplace_back();
    rule.least_ratio = least_ratio(points, relative_tolerance);
    const std::size_t count = static_cast<std::size_t>(points * points) * stride_;
    for (auto* values : {&rule.x, &rule.y, &rule.z, &rule.weight}) values->assign(count, 0.0);
  }
  for (auto* values :
       {&centre_x_, &centre_y_, &centre_z_, &radius_, &normal_x_, &normal_y_, &normal_z_})
    values->assign(stride_, 0.0);
  for (std::size_t at = 0; at < order_.size(); ++at) {
    const PlanarPolygon& patch = patches[order_[at]];
    position_of_[order_[at]] = static_cast<std::uint32_t>(at);
    centre_x_[at] = patch.centroid.x();
    centre_y_[at] = patch.centroid.y();
    centre_z_[at] = patch.centroid.z();
    radius_[at] = patch.radius_m;
    normal_x_[at] = patch.plane.normal.x();
    normal_y_[at] = patch.plane.normal.y();
    normal_z_[at] = patch.plane.normal.z();
    is_simple_[at] = patch.vertices.size() <= 4;
    if (!is_simple_[at]) {
      buffer_of_[at] = static_cast<std::uint32_t>(buffers_.size());
      auto& buffers = buffers_.emplace_back();
      auto& buffered = buffered_.emplace_back();
      for (std::size_t k = 0; k < kOrders; ++k)
        buffered[k] = buffers[k].fill(patch, kLeastOrder + static_cast<int>(k));
      continue;
    }
    for (int k = 0; k < kOrders; ++k) {
      Rule& rule = rules_[static_cast<std::size_t>(k)];
      std::size_t to = at;
      for_each_point(patch, kLeastOrder + k, [&](const Vec3& point, double weight) {
        rule.x[to] = point.x();
        rule.y[to] = point.y();
        rule.z[to] = point.z();
        rule.weight[to] = weight;
        to += stride_;
      });
    }
  }
}

PatchPoints PairKernel::points(int order, std::size_t position) const {
  if (is_simple_[position]) return run_points(order, position);
  return buffered_[buffer_of_[position]][static_cast<std::size_t>(order - kLeastOrder)];
}

PatchPoints PairKernel::run_points(int order, std::size_t position) const {
  const Rule& rule = rules_[static_cast<std::size_t>(order - kLeastOrder)];
  return {&rule.x[position],      &rule.y[position], &rule.z[position],
          &rule.weight[position], stride_,           static_cast<std::uint32_t>(order * order)};
}

double PairKernel::product_rule(int order, std::uint32_t i, std::uint32_t j) const {
  const PatchPoints p = points(order, position_of_[i]), q = points(order, position_of_[j]);
  const Vec3 &n = patches_[i].plane.normal, &m = patches_[j].plane.normal;
  double sum = 0.0;
  for (std::uint32_t a = 0; a < p.count; ++a) {
    const Vec3 x = p.at(a);
    double inner = 0.0;
    for (std::uint32_t b = 0; b < q.count; ++b) {
      const Vec3 y = q.at(b);
      const double dx = y.x() - x.x(), dy = y.y() - x.y(), dz = y.z() - x.z();
      const double cos_first = n.x() * dx + n.y() * dy + n.z() * dz;
      const double cos_second = m.x() * dx + m.y() * dy + m.z() * dz;
      const double r2 = dx * dx + dy * dy + dz * dz;
      inner += q.weight_at(b) * cos_first * cos_second / (r2 * r2);
    }
    sum += p.weight_at(a) * inner;
  }
  return -sum / std::numbers::pi;
}

// 0: too near for any.
int PairKernel::order_for(std::uint32_t i, std::uint32_t j) const {
  const std::uint32_t a = position_of_[i], b = position_of_[j];
  const double large = std::max(radius_[a], radius_[b]), small = std::min(radius_[a], radius_[b]);
  const double dx = centre_x_[a] - centre_x_[b], dy = centre_y_[a] - centre_y_[b],
               dz = centre_z_[a] - centre_z_[b];
  const double d2 = dx * dx + dy * dy + dz * dz;
  for (int k = 0; k < kOrders; ++k) {
    const double reach = rules_[static_cast<std::size_t>(k)].least_ratio * large + small;
    if (d2 >= reach * reach) return kLeastOrder + k;
  }
  return 0;
}

bool PairKernel::is_in_front(const PlanarPolygon& polygon, const Plane& plane) const {
  return std::all_of(polygon.vertices.begin(), polygon.vertices.end(),
                     [&](const Vec3& v) { return plane.distance_m(v) >= -tolerance_m_; });
}

double PairKernel::exchange_area_m2(std::uint32_t i, std::uint32_t j) const {
  if (j < i) std::swap(i, j);  // the same sums in the same order, whoever is named first
  const PlanarPolygon &a = patches_[i], &b = patches_[j];
  const int order = order_for(i, j);
  if (order == 0 || !is_in_front(a, b.plane) || !is_in_front(b, a.plane))
    return truebox::exchange_area_m2(a, b, tolerance_);
  return std::max(0.0, product_rule(order, i, j));
}

void PairKernel::exchange_areas_m2(std::uint32_t i, std::size_t begin, bool face_wholly,
                                   std::span<double> result) const {
  if (!face_wholly || !is_simple_[position_of_[i]]) {
    for (std::size_t k = 0; k < result.size(); ++k)
      result[k] = exchange_area_m2(i, order_[begin + k]);
    return;
  }
  const std::size_t own = position_of_[i];
  const bool first = result.empty() || i < order_[begin];
  std::array<double, kLanes> found;
  std::array<int, kLanes> orders;
  for (std::size_t done = 0; done < result.size(); done += kLanes) {
    const std::size_t at = begin + done, lanes = std::min(kLanes, result.size() - done);
    unsigned wanted = 0;
    for (std::size_t l = 0; l < lanes; ++l) {
      orders[l] = is_simple_[at + l] ? order_for(i, order_[at + l]) : 0;
      wanted |= 1u << orders[l];
    }
    for (int order = kLeastOrder; order < kLeastOrder + kOrders; ++order) {
      if (!(wanted >> order & 1u)) continue;
      const BatchEnd patch{run_points(order, own), &normal_x_[own], &normal_y_[own],
                           &normal_z_[own]};
      const BatchEnd run{run_points(order, at), &normal_x_[at], &normal_y_[at], &normal_z_[at]};
      if (first)
        product_rules_to_run(patch, run, found.data());
      else
        product_rules_from_run(run, patch, found.data());
      for (std::size_t l = 0; l < lanes; ++l)
        if (orders[l] == order) result[done + l] = std::max(0.0, found[l]);
    }
    if (wanted & 1u)
      for (std::size_t l = 0; l < lanes; ++l)
        if (orders[l] == 0) result[done + l] = exchange_area_m2(i, order_[at + l]);
  }
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

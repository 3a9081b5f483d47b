// SPDX-License-Identifier: BSD-3-Clause
#include "hierarchy/group_samples.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cmath>

#include "transport/enclosure.h"
#include "transport/quadrature.h"

namespace truebox {
namespace {

// Root of x^3 = x + 1: steps 1/p and 1/p^2 spread points evenly over the square (Roberts 2018).
constexpr double kPlastic = 1.32471795724474602596;

void set(GroupSamples& samples, int k, const Vec3& offset, const Vec3& normal, double weight) {
  samples.x[k] = static_cast<float>(offset.x());
  samples.y[k] = static_cast<float>(offset.y());
  samples.z[k] = static_cast<float>(offset.z());
  samples.nx[k] = static_cast<float>(normal.x());
  samples.ny[k] = static_cast<float>(normal.y());
  samples.nz[k] = static_cast<float>(normal.z());
  samples.weight[k] = static_cast<float>(weight);
}

// The quadrilateral that a group fills, or nothing.
Polygon filled_quad(const PatchMesh& mesh, const ElementTree& tree, const ElementNode& node) {
  Polygon quad;
  if (node.is_leaf())
    mesh.polygon_of(mesh.patches[tree.order[node.begin]], quad);
  else if (node.is_flat)
    quad.assign(node.corners.begin(), node.corners.begin() + 4);
  if (quad.size() != 4 || std::abs(area_vector(quad).norm() - node.area_m2) > 1e-6 * node.area_m2)
    quad.clear();
  return quad;
}

GroupSamples gauss_samples(const Polygon& q, const ElementNode& node) {
  GroupSamples samples;
  const GaussRule& rule = gauss_rule(4);
  for (int k = 0; k < kGroupSamples; ++k) {
    const double u = rule.nodes[k % 4], v = rule.nodes[k / 4];
    const Vec3 du = (1 - v) * (q[1] - q[0]) + v * (q[2] - q[3]);
    const Vec3 dv = (1 - u) * (q[3] - q[0]) + u * (q[2] - q[1]);
    const Vec3 at = (1 - v) * ((1 - u) * q[0] + u * q[1]) + v * ((1 - u) * q[3] + u * q[2]);
    set(samples, k, at - node.centre, node.normal,
        rule.weights[k % 4] * rule.weights[k / 4] * node.normal.dot(du.cross(dv)) / node.area_m2);
  }
  return samples;
}

GroupSamples samples_of(const PatchMesh& mesh, const ElementTree& tree, const ElementNode& node,
                        std::uint64_t seed) {
  if (const Polygon quad = filled_quad(mesh, tree, node); !quad.empty())
    return gauss_samples(quad, node);
  GroupSamples samples;
  double u = unit_interval(hash(seed)), v = unit_interval(hash(seed + 1));
  const double shift = unit_interval(hash(seed + 2));
  Polygon polygon;
  std::uint32_t place = node.begin;
  double passed_m2 = 0.0;  // area of the elements before `place`
  for (int k = 0; k < kGroupSamples; ++k) {
    const double target_m2 = (k + shift) / kGroupSamples * node.area_m2;
    while (place + 1 < node.end && passed_m2 + mesh.patches[tree.order[place]].area_m2 < target_m2)
      passed_m2 += mesh.patches[tree.order[place++]].area_m2;
    const Patch& patch = mesh.patches[tree.order[place]];
    u += 1.0 / kPlastic;
    v += 1.0 / (kPlastic * kPlastic);
    u -= std::floor(u);
    v -= std::floor(v);
    mesh.polygon_of(patch, polygon);
    set(samples, k, sample_polygon(polygon, u, v) - node.centre, mesh.plane_of(patch).normal,
        1.0 / kGroupSamples);
  }
  return samples;
}

}  // namespace

std::vector<GroupSamples> group_samples(const PatchMesh& mesh, const ElementTree& tree,
                                        std::uint64_t seed) {
  std::vector<GroupSamples> all(tree.nodes.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, all.size(), 256), [&](const auto& range) {
    for (std::size_t k = range.begin(); k < range.end(); ++k)
      all[k] = samples_of(mesh, tree, tree.nodes[k], hash(seed ^ hash(k)));
  });
  return all;
}

}  // namespace truebox

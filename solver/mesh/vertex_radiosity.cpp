// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/vertex_radiosity.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "mesh/wachspress.h"

namespace truebox {
namespace {

using Group = std::vector<std::uint32_t>;  // elements around a vertex, on one side of any contact

Eigen::RowVectorXd mean_of(const BandMatrix& means, const Group& group) {
  Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(means.cols());
  for (std::uint32_t p : group) sum += means.row(p);
  return sum / static_cast<double>(group.size());
}

// The plane through the means as seen at the vertex; their mean where they do not span a plane.
Eigen::RowVectorXd fitted(const PatchMesh& mesh, const BandMatrix& means, const Group& group,
                          const Vec3& vertex) {
  const Vec3& normal = mesh.plane_of(mesh.patches[group[0]]).normal;
  const Vec3 u = normal.unitOrthogonal(), v = normal.cross(u);
  const auto n = static_cast<Eigen::Index>(group.size());
  const double size = std::sqrt(mesh.patches[group[0]].area_m2);
  Eigen::MatrixXd basis(n, 3);
  Eigen::MatrixXd values(n, means.cols());
  for (Eigen::Index i = 0; i < n; ++i) {
    const Patch& patch = mesh.patches[group[static_cast<std::size_t>(i)]];
    const Vec3 d = (patch.centroid - vertex) / size;
    basis.row(i) << 1.0, d.dot(u), d.dot(v);
    values.row(i) = means.row(group[static_cast<std::size_t>(i)]);
  }
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(basis);
  if (n < 3 || qr.rank() < 3) return mean_of(means, group);
  return qr.solve(values).row(0);
}

}  // namespace

VertexRadiosity::VertexRadiosity(const PatchMesh& mesh, const std::vector<char>& usable,
                                 const BandMatrix& means, VertexRule rule)
    : mesh_(&mesh), corner_of_(mesh.corners.size()) {
  const PatchTopology topology(mesh);
  struct Place {
    std::uint32_t vertex, patch;
    bool is_inside;
    Group group;
  };
  std::map<std::pair<std::uint32_t, Group>, std::uint32_t> known;
  std::vector<Place> places;
  for (std::uint32_t p = 0; p < mesh.size(); ++p) {
    const auto corners = mesh.corners_of(mesh.patches[p]);
    for (std::size_t k = 0; k < corners.size(); ++k) {
      Group group = topology.reachable(usable, p, corners[k], 1);
      const auto [it, is_new] =
          known.try_emplace({corners[k], group}, static_cast<std::uint32_t>(places.size()));
      corner_of_[mesh.patches[p].first_corner + k] = it->second;
      if (!is_new) continue;
      // Inside: every edge that ends in the vertex has usable elements on both sides.
      bool is_inside = true;
      for (std::uint32_t q : group) {
        const auto around = mesh.corners_of(mesh.patches[q]);
        for (std::size_t l = 0; l < around.size(); ++l) {
          if (around[l] != corners[k] && around[(l + 1) % around.size()] != corners[k]) continue;
          const auto others = topology.across(q, l);
          is_inside &= !others.empty() && std::all_of(others.begin(), others.end(),
                                                      [&](auto other) { return usable[other]; });
        }
      }
      places.push_back({corners[k], p, is_inside, std::move(group)});
    }
  }
  values_.resize(static_cast<Eigen::Index>(places.size()), means.cols());
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Place& place = places[i];
    const auto row = static_cast<Eigen::Index>(i);
    if (rule == VertexRule::averaged) {
      values_.row(row) = mean_of(means, place.group);
      continue;
    }
    Group group = place.group;
    for (int rings = 2; group.size() < 4 && rings <= 3; ++rings)
      group = topology.reachable(usable, place.patch, place.vertex, rings);
    values_.row(row) = fitted(mesh, means, group, mesh.vertices[place.vertex]);
  }
  // Larger elements decide what their edges hold, or smaller neighbours would leave a crack.
  const auto close_cracks = [&] {
    for (const PatchTopology::Constraint& c : topology.constraints(usable))
      values_.row(corner_of_[c.corner]) = (1.0 - c.share) * values_.row(corner_of_[c.from]) +
                                          c.share * values_.row(corner_of_[c.to]);
  };
  if (rule == VertexRule::least_squares) {
    close_cracks();
    return;
  }
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (places[i].is_inside) continue;
    double nearest = std::numeric_limits<double>::infinity();
    std::uint32_t inside = 0;
    for (std::uint32_t q : places[i].group)
      for (std::size_t l = 0; l < mesh.patches[q].corner_count; ++l) {
        const std::uint32_t candidate = corner_of_[mesh.patches[q].first_corner + l];
        if (!places[candidate].is_inside) continue;
        const double distance =
            (mesh.vertices[places[candidate].vertex] - mesh.vertices[places[i].vertex]).norm();
        if (distance < nearest) nearest = distance, inside = candidate;
      }
    if (std::isinf(nearest)) continue;  // no vertex inside: what the average says
    values_.row(static_cast<Eigen::Index>(i)) =
        2.0 * mean_of(means, places[i].group) - values_.row(inside);
  }
  close_cracks();
}

Eigen::VectorXd VertexRadiosity::at_corner(std::uint32_t patch, std::size_t k) const {
  return values_.row(corner_of_[mesh_->patches[patch].first_corner + k]);
}

void VertexRadiosity::evaluate(std::uint32_t patch_index, const Vec3& point,
                               Eigen::Ref<Eigen::VectorXd> values) const {
  const Patch& patch = mesh_->patches[patch_index];
  WachspressWeights lambda;
  const std::size_t count = wachspress_weights(*mesh_, patch, point, lambda);
  values.setZero();
  for (std::size_t k = 0; k < count; ++k)
    values += lambda[k] * values_.row(corner_of_[patch.first_corner + k]).transpose();
}

}  // namespace truebox

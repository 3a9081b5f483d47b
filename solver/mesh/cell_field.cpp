// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/cell_field.h"

#include <limits>
#include <map>

#include "mesh/patch_topology.h"

namespace truebox {
namespace {
constexpr double kInside = 0.1;  // of the way to the centroid: corners on a rim
}

CellField::CellField(LayeredMesh cells, const Scene& scene, const std::vector<char>& usable,
                     Eigen::Index bands)
    : cells_(std::move(cells)) {
  const PatchMesh& mesh = cells_.mesh;
  std::vector<char> has_nodes(mesh.size());
  for (std::size_t c = 0; c < has_nodes.size(); ++c)
    has_nodes[c] =
        usable[cells_.parent[c]] && !scene.surfaces[mesh.surface_of(mesh.patches[c])].is_opening;
  const PatchTopology topology(mesh);
  node_of_.assign(mesh.corners.size(), kNone);
  // A corner is one place to all cells that can be reached around it, not across contact lines.
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> known;
  for (std::uint32_t c = 0; c < mesh.size(); ++c) {
    if (!has_nodes[c]) continue;
    const Patch& cell = mesh.patches[c];
    for (std::uint32_t k = 0; k < cell.corner_count; ++k) {
      const std::uint32_t vertex = mesh.corners[cell.first_corner + k];
      const std::uint32_t first = topology.reachable(has_nodes, c, vertex, 1).front();
      const auto [it, is_new] =
          known.try_emplace({vertex, first}, static_cast<std::uint32_t>(nodes_.size()));
      node_of_[cell.first_corner + k] = it->second;
      if (is_new) nodes_.push_back({mesh.vertices[vertex], cells_.parent[c]});
      const std::uint32_t before = (k + cell.corner_count - 1) % cell.corner_count;
      Node& node = nodes_[it->second];
      const bool is_rim = topology.across(c, k).empty() || topology.across(c, before).empty();
      if (is_rim && node.point == mesh.vertices[vertex]) {
        node.point += kInside * (cell.centroid - node.point);
        node.patch = cells_.parent[c];
      }
    }
  }
  for (const PatchTopology::Constraint& c : topology.constraints(has_nodes)) {
    hanging_.push_back({node_of_[c.corner], node_of_[c.from], node_of_[c.to], c.share});
    nodes_[node_of_[c.corner]].is_hanging = true;
  }
  values = BandMatrix::Zero(static_cast<Eigen::Index>(nodes_.size()), bands);
}

void CellField::tie_hanging(BandMatrix& of_nodes) const {
  for (const Hanging& h : hanging_)
    of_nodes.row(h.node) = (1.0 - h.share) * of_nodes.row(h.from) + h.share * of_nodes.row(h.to);
}

std::uint32_t CellField::find_cell(std::uint32_t patch, const Vec3& point) const {
  const PatchMesh& mesh = cells_.mesh;
  std::uint32_t nearest = cells_.first_cell[patch];
  const std::uint32_t end = cells_.first_cell[patch + 1];
  if (end - nearest == 1) return nearest;
  const Vec3& normal = mesh.plane_of(mesh.patches[nearest]).normal;
  double best_m2 = std::numeric_limits<double>::infinity();
  for (std::uint32_t c = nearest; c < end; ++c) {
    const auto corners = mesh.corners_of(mesh.patches[c]);
    double outside_m2 = 0.0;
    for (std::size_t k = 0; k < corners.size() && outside_m2 < best_m2; ++k) {
      const Vec3& a = mesh.vertices[corners[k]];
      const Vec3 along = mesh.vertices[corners[(k + 1) % corners.size()]] - a;
      const double side = normal.cross(along).dot(point - a);
      if (side < 0.0) outside_m2 = std::max(outside_m2, side * side / along.squaredNorm());
    }
    if (outside_m2 == 0.0) return c;
    if (outside_m2 < best_m2) best_m2 = outside_m2, nearest = c;
  }
  return nearest;
}

CellField::Shares CellField::shares_at(std::uint32_t index, const Vec3& point) const {
  Shares shares;
  const Patch& cell = cells_.mesh.patches[index];
  if (node_of_[cell.first_corner] == kNone) return shares;
  WachspressWeights lambda;
  shares.count = wachspress_weights(cells_.mesh, cell, point, lambda);
  for (std::size_t k = 0; k < shares.count; ++k)
    shares.of[k] = {node_of_[cell.first_corner + k], lambda[k]};
  return shares;
}

void CellField::add_to(std::uint32_t cell, const Vec3& point,
                       Eigen::Ref<Eigen::VectorXd> sum) const {
  for (const Share& share : shares_at(cell, point))
    sum += share.factor * values.row(share.node).transpose();
}

}  // namespace truebox

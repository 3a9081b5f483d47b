// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/patch_topology.h"

#include <algorithm>
#include <set>

namespace truebox {
namespace {

std::pair<std::uint32_t, std::uint32_t> edge_of(std::uint32_t a, std::uint32_t b) {
  return {std::min(a, b), std::max(a, b)};
}

bool lies_on(const Vec3& point, const ContactLine& line, double tolerance_m) {
  const Vec3 along = line.to - line.from;
  const double t = std::clamp(along.dot(point - line.from) / along.squaredNorm(), 0.0, 1.0);
  return (point - line.from - t * along).norm() < tolerance_m;
}

}  // namespace

PatchTopology::PatchTopology(const PatchMesh& mesh)
    : mesh_(&mesh), patches_at_(mesh.vertices.size()) {
  for (std::uint32_t p = 0; p < mesh.size(); ++p) {
    const auto corners = mesh.corners_of(mesh.patches[p]);
    for (std::size_t k = 0; k < corners.size(); ++k) {
      patches_at_[corners[k]].push_back(p);
      auto [it, is_new] = patches_along_.try_emplace(
          edge_of(corners[k], corners[(k + 1) % corners.size()]), std::array{p, kNone});
      if (!is_new) it->second[1] = p;
    }
  }
  for (auto& [edge, sides] : patches_along_) {
    const Piece& piece = mesh.pieces[mesh.patches[sides[0]].piece];
    for (const ContactLine& line : piece.contacts)
      if (lies_on(mesh.vertices[edge.first], line, 1e-6 * piece.diameter_m) &&
          lies_on(mesh.vertices[edge.second], line, 1e-6 * piece.diameter_m))
        sides = {kNone, kNone};
  }
}

std::uint32_t PatchTopology::across(std::uint32_t patch, std::size_t k) const {
  const auto corners = mesh_->corners_of(mesh_->patches[patch]);
  const auto& pair = patches_along_.at(edge_of(corners[k], corners[(k + 1) % corners.size()]));
  return pair[0] == patch ? pair[1] : pair[0];
}

std::vector<std::uint32_t> PatchTopology::reachable(const std::vector<char>& usable,
                                                    std::uint32_t start, std::uint32_t vertex,
                                                    int rings) const {
  std::set<std::uint32_t> ring(patches_at_[vertex].begin(), patches_at_[vertex].end());
  for (int r = 1; r < rings; ++r) {
    std::set<std::uint32_t> wider = ring;
    for (std::uint32_t p : ring)
      for (std::uint32_t v : mesh_->corners_of(mesh_->patches[p]))
        wider.insert(patches_at_[v].begin(), patches_at_[v].end());
    ring.swap(wider);
  }
  std::vector<std::uint32_t> found{start};
  std::set<std::uint32_t> seen{start};
  for (std::size_t next = 0; next < found.size(); ++next) {
    const std::size_t corners = mesh_->corners_of(mesh_->patches[found[next]]).size();
    for (std::size_t k = 0; k < corners; ++k) {
      const std::uint32_t other = across(found[next], k);
      if (other == kNone || !usable[other] || !ring.contains(other)) continue;
      if (seen.insert(other).second) found.push_back(other);
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace truebox

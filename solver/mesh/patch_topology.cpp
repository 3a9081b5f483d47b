// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/patch_topology.h"

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "mesh/hanging_vertices.h"

namespace truebox {
namespace {

bool lies_on(const Vec3& point, const ContactLine& line, double tolerance_m) {
  const Vec3 along = line.to - line.from;
  const double t = std::clamp(along.dot(point - line.from) / along.squaredNorm(), 0.0, 1.0);
  return (point - line.from - t * along).norm() < tolerance_m;
}

bool is_contact(const PatchMesh& mesh, const Piece& piece, std::uint32_t a, std::uint32_t b) {
  const double tolerance_m = 1e-6 * piece.diameter_m;
  return std::any_of(piece.contacts.begin(), piece.contacts.end(), [&](const ContactLine& line) {
    return lies_on(mesh.vertices[a], line, tolerance_m) &&
           lies_on(mesh.vertices[b], line, tolerance_m);
  });
}

std::uint32_t patch_of(const PatchMesh& mesh, std::uint32_t corner) {
  const auto after =
      std::upper_bound(mesh.patches.begin(), mesh.patches.end(), corner,
                       [](std::uint32_t c, const Patch& patch) { return c < patch.first_corner; });
  return static_cast<std::uint32_t>(after - mesh.patches.begin()) - 1;
}

}  // namespace

PatchTopology::PatchTopology(const PatchMesh& mesh)
    : mesh_(&mesh), patches_at_(mesh.vertices.size()), across_(mesh.corners.size()) {
  // Edges end at every vertex on them, so that what two elements share is one and the same.
  std::map<std::uint32_t, std::vector<HangingVertex>> hanging;
  for (const HangingVertex& h : hanging_vertices(mesh)) {
    hanging[mesh.patches[h.patch].first_corner + h.corner].push_back(h);
    patches_at_[h.vertex].push_back(h.patch);
  }
  struct Side {
    std::uint32_t patch, entry;
  };
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<Side>> sides;
  for (std::uint32_t p = 0; p < mesh.size(); ++p) {
    const auto corners = mesh.corners_of(mesh.patches[p]);
    for (std::uint32_t k = 0; k < corners.size(); ++k) {
      patches_at_[corners[k]].push_back(p);
      const std::uint32_t entry = mesh.patches[p].first_corner + k;
      std::uint32_t from = corners[k];
      const auto add = [&](std::uint32_t to) {
        sides[std::minmax(from, to)].push_back({p, entry});
        from = to;
      };
      if (const auto found = hanging.find(entry); found != hanging.end())
        for (const HangingVertex& h : found->second) add(h.vertex);
      add(corners[(k + 1) % corners.size()]);
    }
  }
  for (const auto& [edge, pair] : sides) {
    if (pair.size() != 2) continue;
    const Piece& piece = mesh.pieces[mesh.patches[pair[0].patch].piece];
    if (is_contact(mesh, piece, edge.first, edge.second)) continue;
    across_[pair[0].entry].push_back(pair[1].patch);
    across_[pair[1].entry].push_back(pair[0].patch);
  }
  for (const auto& [entry, on_edge] : hanging)
    for (const HangingVertex& h : on_edge) {
      const Patch& large = mesh.patches[h.patch];
      const std::uint32_t next = large.first_corner + (h.corner + 1) % large.corner_count;
      for (std::uint32_t small : across_[entry]) {
        const auto corners = mesh.corners_of(mesh.patches[small]);
        const auto at = std::find(corners.begin(), corners.end(), h.vertex);
        if (at == corners.end()) continue;
        const auto k = static_cast<std::uint32_t>(at - corners.begin());
        constraints_.push_back({mesh.patches[small].first_corner + k, entry, next, h.share});
      }
    }
}

std::vector<PatchTopology::Constraint> PatchTopology::constraints(
    const std::vector<char>& usable) const {
  std::map<std::uint32_t, std::vector<std::size_t>> of_vertex;
  for (std::size_t i = 0; i < constraints_.size(); ++i)
    of_vertex[mesh_->corners[constraints_[i].corner]].push_back(i);
  std::vector<Constraint> ordered;
  std::vector<char> state(constraints_.size(), 0);
  // What a corner depends on comes first.
  const auto visit = [&](const auto& self, std::size_t i) -> void {
    if (state[i]) return;
    state[i] = 1;
    const Constraint& c = constraints_[i];
    for (const std::uint32_t end : {c.from, c.to})
      if (const auto found = of_vertex.find(mesh_->corners[end]); found != of_vertex.end())
        for (std::size_t other : found->second) self(self, other);
    if (usable[patch_of(*mesh_, c.corner)] && usable[patch_of(*mesh_, c.from)])
      ordered.push_back(c);
  };
  for (std::size_t i = 0; i < constraints_.size(); ++i) visit(visit, i);
  return ordered;
}

std::span<const std::uint32_t> PatchTopology::across(std::uint32_t patch, std::size_t k) const {
  return across_[mesh_->patches[patch].first_corner + k];
}

std::vector<std::uint32_t> PatchTopology::reachable(const std::vector<char>& usable,
                                                    std::uint32_t start, std::uint32_t vertex,
                                                    int rings) const {
  std::vector<std::uint32_t> ring = patches_at_[vertex], wider;  // sorted, each once
  for (int r = 0; r < rings; ++r) {
    if (r > 0) {
      wider = ring;
      for (std::uint32_t p : ring)
        for (std::uint32_t v : mesh_->corners_of(mesh_->patches[p]))
          wider.insert(wider.end(), patches_at_[v].begin(), patches_at_[v].end());
      ring.swap(wider);
    }
    std::sort(ring.begin(), ring.end());
    ring.erase(std::unique(ring.begin(), ring.end()), ring.end());
  }
  std::vector<char> seen(ring.size(), 0);
  const auto see = [&](std::uint32_t p) {  // true the first time
    const auto at = std::lower_bound(ring.begin(), ring.end(), p);
    if (at == ring.end() || *at != p) return false;
    return !std::exchange(seen[static_cast<std::size_t>(at - ring.begin())], 1);
  };
  std::vector<std::uint32_t> found{start};
  see(start);
  for (std::size_t next = 0; next < found.size(); ++next) {
    const std::size_t corners = mesh_->corners_of(mesh_->patches[found[next]]).size();
    for (std::size_t k = 0; k < corners; ++k)
      for (std::uint32_t other : across(found[next], k))
        if (usable[other] && see(other)) found.push_back(other);
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace truebox

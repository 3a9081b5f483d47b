// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/hanging_vertices.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

namespace truebox {
namespace {

struct OpenEdge {
  std::uint32_t patch, corner, from, to;
};

// Edges of a piece that only one element has: its outline, and wherever larger meets smaller.
std::vector<OpenEdge> open_edges(const PatchMesh& mesh, const Piece& piece) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, OpenEdge> open;
  for (std::uint32_t p = piece.first_patch; p < piece.first_patch + piece.patch_count; ++p) {
    const auto corners = mesh.corners_of(mesh.patches[p]);
    for (std::uint32_t k = 0; k < corners.size(); ++k) {
      const std::uint32_t a = corners[k], b = corners[(k + 1) % corners.size()];
      if (open.erase({b, a}) == 0) open[{a, b}] = {p, k, a, b};
    }
  }
  std::vector<OpenEdge> edges;
  for (const auto& [ends, edge] : open) edges.push_back(edge);
  return edges;
}

// Vertices sorted along one axis, so that an edge looks only at those beside it.
class SortedVertices {
 public:
  SortedVertices(const PatchMesh& mesh, const Piece& piece, const std::vector<OpenEdge>& edges)
      : axis_((piece.polygon[1] - piece.polygon[0]).normalized()) {
    std::vector<std::uint32_t> ids;
    for (const OpenEdge& edge : edges) ids.insert(ids.end(), {edge.from, edge.to});
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
    for (std::uint32_t v : ids) sorted_.emplace_back(axis_.dot(mesh.vertices[v]), v);
    std::sort(sorted_.begin(), sorted_.end());
  }

  template <class Visit>
  void between(const Vec3& a, const Vec3& b, double margin_m, const Visit& visit) const {
    const auto [low, high] = std::minmax({axis_.dot(a), axis_.dot(b)});
    for (auto at = std::lower_bound(sorted_.begin(), sorted_.end(),
                                    std::pair(low - margin_m, std::uint32_t{0}));
         at != sorted_.end() && at->first <= high + margin_m; ++at)
      visit(at->second);
  }

 private:
  Vec3 axis_;
  std::vector<std::pair<double, std::uint32_t>> sorted_;
};

}  // namespace

std::vector<HangingVertex> hanging_vertices(const PatchMesh& mesh) {
  std::vector<HangingVertex> all;
  for (const Piece& piece : mesh.pieces) {
    const std::vector<OpenEdge> edges = open_edges(mesh, piece);
    if (edges.empty()) continue;
    const SortedVertices vertices(mesh, piece, edges);
    const double tolerance_m = 1e-8 * piece.diameter_m;
    for (const OpenEdge& edge : edges) {
      const Vec3 &a = mesh.vertices[edge.from], &b = mesh.vertices[edge.to];
      const double length_m = (b - a).norm();
      const Vec3 along = (b - a) / length_m;
      const std::size_t first = all.size();
      vertices.between(a, b, tolerance_m, [&](std::uint32_t v) {
        const double at_m = along.dot(mesh.vertices[v] - a);
        if (at_m < 2.0 * tolerance_m || at_m > length_m - 2.0 * tolerance_m) return;
        if ((mesh.vertices[v] - a - at_m * along).norm() > tolerance_m) return;
        all.push_back({v, edge.patch, edge.corner, at_m / length_m});
      });
      std::sort(all.begin() + static_cast<std::ptrdiff_t>(first), all.end(),
                [](const auto& x, const auto& y) { return x.share < y.share; });
    }
  }
  return all;
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/hanging_vertices.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

namespace truebox {
namespace {

struct OpenEdge {
  std::uint32_t patch, corner, from, to;
};

// Edges of elements that have none on their other side: the outline of them all, and wherever
// larger meets smaller.
class OpenEdges {
 public:
  void add(const PatchMesh& mesh, std::uint32_t patch) {
    const auto corners = mesh.corners_of(mesh.patches[patch]);
    for (std::uint32_t k = 0; k < corners.size(); ++k) {
      const std::uint32_t a = corners[k], b = corners[(k + 1) % corners.size()];
      if (open_.erase({b, a}) == 0) open_[{a, b}] = {patch, k, a, b};
    }
  }
  std::vector<OpenEdge> list() const {
    std::vector<OpenEdge> edges;
    for (const auto& [ends, edge] : open_) edges.push_back(edge);
    return edges;
  }

 private:
  std::map<std::pair<std::uint32_t, std::uint32_t>, OpenEdge> open_;
};

// Vertices sorted along one axis, so that an edge looks only at those beside it.
class SortedVertices {
 public:
  SortedVertices(const PatchMesh& mesh, const Vec3& axis, const std::vector<OpenEdge>& edges)
      : axis_(axis) {
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
  template <class Visit>
  void each(const Visit& visit) const {
    for (const auto& [at, vertex] : sorted_) visit(vertex);
  }

 private:
  Vec3 axis_;
  std::vector<std::pair<double, std::uint32_t>> sorted_;
};

// Appends the vertices inside an edge in their order along it, one of those at the same place.
void add_inside(const PatchMesh& mesh, const SortedVertices& vertices, const OpenEdge& edge,
                double tolerance_m, std::vector<HangingVertex>& all) {
  const Vec3 &a = mesh.vertices[edge.from], &b = mesh.vertices[edge.to];
  const double length_m = (b - a).norm();
  const Vec3 along = (b - a) / length_m;
  const auto first = static_cast<std::ptrdiff_t>(all.size());
  vertices.between(a, b, tolerance_m, [&](std::uint32_t v) {
    const double at_m = along.dot(mesh.vertices[v] - a);
    if (at_m < 2.0 * tolerance_m || at_m > length_m - 2.0 * tolerance_m) return;
    if ((mesh.vertices[v] - a - at_m * along).norm() > tolerance_m) return;
    all.push_back({v, edge.patch, edge.corner, at_m / length_m});
  });
  std::sort(all.begin() + first, all.end(),
            [](const auto& x, const auto& y) { return x.share < y.share; });
  all.erase(std::unique(all.begin() + first, all.end(),
                        [&](const auto& x, const auto& y) {
                          return (y.share - x.share) * length_m < 2.0 * tolerance_m;
                        }),
            all.end());
}

constexpr double kSamePlace = 1e-8;  // of the size of what is looked at

}  // namespace

std::vector<HangingVertex> hanging_vertices(const PatchMesh& mesh) {
  std::vector<HangingVertex> all;
  for (const Piece& piece : mesh.pieces) {
    OpenEdges open;
    for (std::uint32_t p = piece.first_patch; p < piece.first_patch + piece.patch_count; ++p)
      open.add(mesh, p);
    const std::vector<OpenEdge> edges = open.list();
    if (edges.empty()) continue;
    const SortedVertices vertices(mesh, (piece.polygon[1] - piece.polygon[0]).normalized(), edges);
    for (const OpenEdge& edge : edges)
      add_inside(mesh, vertices, edge, kSamePlace * piece.diameter_m, all);
  }
  return all;
}

Seams seams(const PatchMesh& mesh, const std::vector<char>& shown) {
  Seams result;
  result.places.resize(mesh.vertices.size());
  std::iota(result.places.begin(), result.places.end(), 0u);
  OpenEdges open;
  Eigen::AlignedBox3d box;
  for (std::uint32_t p = 0; p < mesh.size(); ++p) {
    if (!shown[p]) continue;
    open.add(mesh, p);
    for (std::uint32_t v : mesh.corners_of(mesh.patches[p])) box.extend(mesh.vertices[v]);
  }
  const std::vector<OpenEdge> edges = open.list();
  if (edges.empty()) return result;
  const double tolerance_m = kSamePlace * box.diagonal().norm();
  // Askew to most scenes' walls, or all vertices of a wall would have one place on the axis.
  const SortedVertices vertices(mesh, Vec3(0.48, 0.64, 0.6), edges);
  vertices.each([&](std::uint32_t v) {
    if (result.places[v] != v) return;
    const Vec3& at = mesh.vertices[v];
    vertices.between(at, at, tolerance_m, [&](std::uint32_t w) {
      if (result.places[w] == w && (mesh.vertices[w] - at).norm() <= tolerance_m)
        result.places[w] = v;
    });
  });
  for (const OpenEdge& edge : edges) add_inside(mesh, vertices, edge, tolerance_m, result.hanging);
  for (HangingVertex& h : result.hanging) h.vertex = result.places[h.vertex];
  return result;
}

}  // namespace truebox

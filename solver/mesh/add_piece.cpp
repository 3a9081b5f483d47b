// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/add_piece.h"

#include <array>
#include <cmath>
#include <map>
#include <utility>

namespace truebox {
namespace {

// Vertices of one piece, found again within a small tolerance.
class VertexPool {
 public:
  VertexPool(std::vector<Vec3>& vertices, const Piece& piece)
      : vertices_(vertices), origin_(piece.polygon[0]), step_m_(1e-8 * piece.diameter_m) {}

  std::uint32_t find_or_add(const Vec3& v) {
    std::array<long long, 3> key{};
    for (int k = 0; k < 3; ++k) key[k] = std::llround((v[k] - origin_[k]) / (4.0 * step_m_));
    // A coordinate on a rounding border may land in the next bin: look there too.
    for (int d = 0; d < 27; ++d) {
      const std::array<long long, 3> near = {key[0] + d % 3 - 1, key[1] + d / 3 % 3 - 1,
                                             key[2] + d / 9 - 1};
      const auto found = bins_.find(near);
      if (found != bins_.end() && (vertices_[found->second] - v).norm() < 2.0 * step_m_)
        return found->second;
    }
    vertices_.push_back(v);
    const auto index = static_cast<std::uint32_t>(vertices_.size() - 1);
    bins_[key] = index;
    return index;
  }

 private:
  std::vector<Vec3>& vertices_;
  Vec3 origin_;
  double step_m_;
  std::map<std::array<long long, 3>, std::uint32_t> bins_;
};

}  // namespace

void add_piece(PatchMesh& mesh, std::size_t surface, const Polygon& polygon,
               std::vector<ContactLine> contacts, const std::vector<Polygon>& cells) {
  Piece piece{surface,
              polygon,
              plane_of(polygon),
              diameter_m(polygon),
              static_cast<std::uint32_t>(mesh.patches.size()),
              static_cast<std::uint32_t>(cells.size()),
              std::move(contacts)};
  VertexPool pool(mesh.vertices, piece);
  for (const Polygon& cell : cells) {
    Patch patch;
    patch.first_corner = static_cast<std::uint32_t>(mesh.corners.size());
    for (const Vec3& v : cell) {
      const std::uint32_t index = pool.find_or_add(v);
      if (mesh.corners.size() == patch.first_corner || mesh.corners.back() != index)
        mesh.corners.push_back(index);
    }
    patch.corner_count = static_cast<std::uint32_t>(mesh.corners.size()) - patch.first_corner;
    patch.piece = static_cast<std::uint32_t>(mesh.pieces.size());
    patch.centroid = centroid(cell);
    patch.area_m2 = area_vector(cell).norm();
    mesh.patches.push_back(patch);
  }
  mesh.pieces.push_back(std::move(piece));
}

}  // namespace truebox

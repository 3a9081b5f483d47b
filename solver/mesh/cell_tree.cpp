// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/cell_tree.h"

#include <utility>

#include "mesh/add_piece.h"
#include "mesh/contact_lines.h"

namespace truebox {
namespace {

Vec3 middle(const Vec3& a, const Vec3& b) { return 0.5 * (a + b); }

void quarter(const Polygon& p, int level, std::vector<Polygon>& parts) {
  if (level == 0) {
    parts.push_back(p);
    return;
  }
  if (p.size() == 3) {
    const Vec3 ab = middle(p[0], p[1]), bc = middle(p[1], p[2]), ca = middle(p[2], p[0]);
    for (const Polygon& part :
         {Polygon{p[0], ab, ca}, Polygon{ab, p[1], bc}, Polygon{ca, bc, p[2]}, Polygon{ab, bc, ca}})
      quarter(part, level - 1, parts);
    return;
  }
  const auto [low, high] = CellTree::halves(p, 0);
  for (const Polygon& half : {low, high}) {
    const auto [first, second] = CellTree::halves(half, 1);
    quarter(first, level - 1, parts);
    quarter(second, level - 1, parts);
  }
}

}  // namespace

std::vector<Polygon> CellTree::quarters(const Polygon& corners, int level) {
  std::vector<Polygon> parts;
  quarter(corners, level, parts);
  return parts;
}

void CellTree::add_places() {
  for (std::size_t s = 0; s < scene_->surfaces.size(); ++s)
    for (const Polygon& polygon : scene_->surfaces[s].pieces)
      pieces_.push_back({s, polygon, contact_lines(polygon, *scene_)});
}

void CellTree::add_cells(std::uint32_t piece, const std::vector<Polygon>& cells) {
  for (Polygon rest : cells) {
    while (rest.size() > 4) {
      cells_.push_back({{rest[0], rest[1], rest[2], rest[3]}, piece});
      rest.erase(rest.begin() + 1, rest.begin() + 3);
    }
    cells_.push_back({std::move(rest), piece});
  }
}

CellTree::CellTree(const Scene& scene, double edge_m) : scene_(&scene) {
  add_places();
  const PatchMesh mesh = uniform_mesh(scene, edge_m);
  Polygon polygon;
  for (const Patch& patch : mesh.patches) {
    mesh.polygon_of(patch, polygon);
    add_cells(patch.piece, {polygon});
  }
}

CellTree::CellTree(const Scene& scene, const std::vector<std::vector<Polygon>>& cells)
    : scene_(&scene) {
  add_places();
  for (std::uint32_t piece = 0; piece < cells.size(); ++piece) add_cells(piece, cells[piece]);
}

bool CellTree::is_opening(std::size_t i) const {
  return scene_->surfaces[pieces_[cells_[i].piece].surface].is_opening;
}

std::pair<Polygon, Polygon> CellTree::halves(const Polygon& p, int direction) {
  if (p.size() == 3) {
    const auto k = static_cast<std::size_t>(direction);
    const Vec3 &a = p[k], &b = p[(k + 1) % 3], &c = p[(k + 2) % 3], m = middle(a, b);
    return {{a, m, c}, {m, b, c}};
  }
  if (direction == 0) {
    const Vec3 low = middle(p[0], p[1]), high = middle(p[2], p[3]);
    return {{p[0], low, high, p[3]}, {low, p[1], p[2], high}};
  }
  const Vec3 right = middle(p[1], p[2]), left = middle(p[3], p[0]);
  return {{p[0], p[1], right, left}, {left, right, p[2], p[3]}};
}

void CellTree::halve(std::size_t i, int direction) {
  auto [first, second] = halves(cells_[i].corners, direction);
  cells_[i].corners = std::move(first);
  cells_.push_back({std::move(second), cells_[i].piece});
}

PatchMesh CellTree::mesh(int level, std::vector<std::uint32_t>* cell_of) const {
  std::vector<std::vector<std::uint32_t>> of_piece(pieces_.size());
  for (std::uint32_t c = 0; c < cells_.size(); ++c) of_piece[cells_[c].piece].push_back(c);
  PatchMesh mesh;
  if (cell_of) cell_of->clear();
  for (std::size_t p = 0; p < pieces_.size(); ++p) {
    std::vector<Polygon> parts;
    for (std::uint32_t c : of_piece[p]) {
      quarter(cells_[c].corners, level, parts);
      if (cell_of) cell_of->resize(cell_of->size() + (std::size_t{1} << (2 * level)), c);
    }
    add_piece(mesh, pieces_[p].surface, pieces_[p].polygon, pieces_[p].contacts, parts);
  }
  return mesh;
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/cell_tree.h"

#include <algorithm>
#include <utility>

#include "mesh/add_piece.h"
#include "mesh/contact_lines.h"
#include "mesh/edge_layers.h"

namespace truebox {
namespace {

constexpr double kMiddle = 0.5;
constexpr double kAtEdge = 0.25;    // 0.15 and 0.5 are worse (Cornell Box)
constexpr double kTouching = 1e-6;  // of a cell's size

Vec3 middle(const Vec3& a, const Vec3& b) { return 0.5 * (a + b); }

double distance_m(const Vec3& point, const ContactLine& line) {
  const Vec3 along = line.to - line.from;
  const double t = std::clamp(along.dot(point - line.from) / along.squaredNorm(), 0.0, 1.0);
  return (line.from + t * along - point).norm();
}

}  // namespace

std::vector<Polygon> CellTree::quarters(const Polygon& corners) {
  std::vector<Polygon> parts;
  cut_in_four(corners, {kMiddle, kMiddle}, parts);
  return parts;
}

void CellTree::cut_in_four(const Polygon& p, const std::array<double, 2>& share,
                           std::vector<Polygon>& parts) {
  if (p.size() == 3) {
    const Vec3 ab = middle(p[0], p[1]), bc = middle(p[1], p[2]), ca = middle(p[2], p[0]);
    parts.insert(parts.end(), {{p[0], ab, ca}, {ab, p[1], bc}, {ca, bc, p[2]}, {ab, bc, ca}});
    return;
  }
  const auto [low, high] = halves(p, 0, share[0]);
  for (const Polygon& half : {low, high}) {
    auto [first, second] = halves(half, 1, share[1]);
    parts.push_back(std::move(first));
    parts.push_back(std::move(second));
  }
}

// Where a quad is cut in a direction: nearer to the one of its two edges that lies on a meeting
// line.
double CellTree::share_of(std::uint32_t piece, const Polygon& p, int direction) const {
  if (p.size() != 4) return kMiddle;
  const std::vector<ContactLine>& lines = pieces_[piece].meeting;
  const auto lies_on_one = [&](const Vec3& a, const Vec3& b) {
    const double tolerance_m = kTouching * (p[2] - p[0]).norm();
    return std::any_of(lines.begin(), lines.end(), [&](const ContactLine& line) {
      return distance_m(a, line) < tolerance_m && distance_m(b, line) < tolerance_m;
    });
  };
  const bool first = direction == 0 ? lies_on_one(p[3], p[0]) : lies_on_one(p[0], p[1]);
  const bool second = direction == 0 ? lies_on_one(p[1], p[2]) : lies_on_one(p[2], p[3]);
  if (first == second) return kMiddle;
  return first ? kAtEdge : 1.0 - kAtEdge;
}

std::vector<Polygon> CellTree::parts(std::size_t i, int level) const {
  const Cell& cell = cells_[i];
  std::vector<Polygon> parts = {cell.corners};
  for (; level > 0; --level) {
    std::vector<Polygon> finer;
    for (const Polygon& part : parts)
      cut_in_four(part, {share_of(cell.piece, part, 0), share_of(cell.piece, part, 1)}, finer);
    parts = std::move(finer);
  }
  return parts;
}

void CellTree::add_places() {
  for (std::size_t s = 0; s < scene_->surfaces.size(); ++s)
    for (const Polygon& polygon : scene_->surfaces[s].pieces)
      pieces_.push_back({s, polygon, contact_lines(polygon, *scene_), {}});
  const PatchMesh pieces = uniform_mesh(*scene_, scene_->diameter_m());
  for (std::uint32_t p = 0; p < pieces_.size(); ++p)
    pieces_[p].meeting = meeting_lines(pieces, *scene_, p);
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

std::pair<Polygon, Polygon> CellTree::halves(const Polygon& p, int direction, double share) {
  if (p.size() == 3) {
    const auto k = static_cast<std::size_t>(direction);
    const Vec3 &a = p[k], &b = p[(k + 1) % 3], &c = p[(k + 2) % 3], m = middle(a, b);
    return {{a, m, c}, {m, b, c}};
  }
  const auto between = [share](const Vec3& a, const Vec3& b) -> Vec3 {
    return (1.0 - share) * a + share * b;
  };
  if (direction == 0) {
    const Vec3 low = between(p[0], p[1]), high = between(p[3], p[2]);
    return {{p[0], low, high, p[3]}, {low, p[1], p[2], high}};
  }
  const Vec3 right = between(p[1], p[2]), left = between(p[0], p[3]);
  return {{p[0], p[1], right, left}, {left, right, p[2], p[3]}};
}

void CellTree::halve(std::size_t i, int direction) {
  const Cell& cell = cells_[i];
  auto [first, second] =
      halves(cell.corners, direction, share_of(cell.piece, cell.corners, direction));
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
      for (Polygon& part : this->parts(c, level)) parts.push_back(std::move(part));
      if (cell_of) cell_of->resize(cell_of->size() + (std::size_t{1} << (2 * level)), c);
    }
    add_piece(mesh, pieces_[p].surface, pieces_[p].polygon, pieces_[p].contacts, parts);
  }
  return mesh;
}

}  // namespace truebox

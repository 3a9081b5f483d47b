// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "mesh/patch_mesh.h"

namespace truebox {

/// Elements of unequal size: triangles and quads that cover the scene's pieces, halved one by one
/// in the direction that is asked for, so that they can be long beside an edge and short across it.
/// Neighbours may differ by any number of halvings; hanging_vertices finds what that leaves.
class CellTree {
 public:
  struct Cell {
    Polygon corners;          ///< three or four
    std::uint32_t piece = 0;  ///< pieces of all surfaces in their order
  };

  /// The cells of uniform_mesh, cut along contact lines; openings get cells twice as long.
  CellTree(const Scene& scene, double edge_m);
  /// Cells of every piece, cut along contact lines already: `cells[piece]`, convex polygons; those
  /// of more than four corners are cut into triangles and quads.
  CellTree(const Scene& scene, const std::vector<std::vector<Polygon>>& cells);

  std::size_t size() const { return cells_.size(); }
  const Cell& cell(std::size_t i) const { return cells_[i]; }
  /// Whether the cell belongs to an opening.
  bool is_opening(std::size_t i) const;

  /// How many ways there are to halve a cell: 2 of a quad, 3 of a triangle.
  static int directions(const Polygon& corners) { return corners.size() == 4 ? 2 : 3; }
  /// Halves of a quad across its edges 0-1 and 2-3 (direction 0) or 1-2 and 3-0 (1); of a triangle
  /// from the middle of edge k to the corner opposite (k).
  static std::pair<Polygon, Polygon> halves(const Polygon& corners, int direction);

  /// The cell cut in four `level` times, the four parts of a part together: of a quad those at its
  /// corners 0, 3, 1, 2; of a triangle those at its corners 0, 1, 2 and the middle.
  static std::vector<Polygon> quarters(const Polygon& corners, int level);

  /// Replaces a cell by its halves: cell i becomes the first, a new last cell the second.
  void halve(std::size_t i, int direction);

  /// The elements: each cell cut in four `level` times. Elements of cell i are those that
  /// `cell_of` says.
  PatchMesh mesh(int level, std::vector<std::uint32_t>* cell_of = nullptr) const;

 private:
  struct Place {
    std::size_t surface;
    Polygon polygon;
    std::vector<ContactLine> contacts;
  };
  const Scene* scene_;
  std::vector<Place> pieces_;
  std::vector<Cell> cells_;

  void add_places();
  void add_cells(std::uint32_t piece, const std::vector<Polygon>& cells);
};

}  // namespace truebox

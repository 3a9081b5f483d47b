// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "mesh/patch_mesh.h"

namespace truebox {

/// Elements of unequal size: triangles and quads that cover the scene's pieces, halved one by one
/// in the direction that is asked for, so that they can be long beside an edge and short across it.
/// A quad with one side where surfaces meet (meeting_lines) is cut at a quarter of its width from
/// there, not in the middle: there radiosity behaves like B0 + c x^lambda, and elements that shrink
/// geometrically follow that with few cuts (Rice 1969). Neighbours may differ by any number of
/// halvings; hanging_vertices finds what that leaves.
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
  /// A quad cut across its edges 0-1 and 2-3 (direction 0) or 1-2 and 3-0 (1) at `share` of their
  /// length; a triangle from the middle of edge k to the corner opposite (k).
  static std::pair<Polygon, Polygon> halves(const Polygon& corners, int direction,
                                            double share = 0.5);

  /// A polygon cut in four in the middle: of a quad the parts at its corners 0, 3, 1, 2; of a
  /// triangle those at its corners 0, 1, 2 and the middle.
  static std::vector<Polygon> quarters(const Polygon& corners);

  /// Replaces a cell by its halves: cell i becomes the first, a new last cell the second.
  void halve(std::size_t i, int direction);

  /// The elements: each cell cut in four `level` times, narrower where surfaces meet; the four
  /// parts of a part together, in the order of `quarters`. Elements of cell i are those that
  /// `cell_of` says.
  PatchMesh mesh(int level, std::vector<std::uint32_t>* cell_of = nullptr) const;

 private:
  struct Place {
    std::size_t surface;
    Polygon polygon;
    std::vector<ContactLine> contacts;
    std::vector<ContactLine> meeting;  // where the radiosity is singular
  };
  const Scene* scene_;
  std::vector<Place> pieces_;
  std::vector<Cell> cells_;

  static void cut_in_four(const Polygon& p, const std::array<double, 2>& share,
                          std::vector<Polygon>& parts);
  double share_of(std::uint32_t piece, const Polygon& p, int direction) const;
  std::vector<Polygon> parts(std::size_t i, int level) const;
  void add_places();
  void add_cells(std::uint32_t piece, const std::vector<Polygon>& cells);
};

}  // namespace truebox

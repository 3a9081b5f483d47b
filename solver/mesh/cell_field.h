// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "mesh/edge_layers.h"
#include "mesh/smooth_field.h"
#include "mesh/wachspress.h"

namespace truebox {

/// A continuous function on the cells of elements from one value a corner ("node") and band:
/// Wachspress' coordinates between them. Cells that can be reached around a corner share its node,
/// those beyond a contact line have their own: jumps stay. A corner that hangs in the edge of a
/// larger cell takes that cell's value: no cracks. Openings and elements that are not usable have
/// no nodes, the function is 0 there.
class CellField {
 public:
  static constexpr std::uint32_t kNone = ~0u;

  struct Node {
    Vec3 point;  ///< of the corner, a tenth of the way inside where it lies on a rim
    std::uint32_t patch = 0;
    bool is_hanging = false;
  };
  /// A share of a node's value.
  struct Share {
    std::uint32_t node = 0;
    double factor = 0.0;
  };
  struct Shares {
    std::array<Share, kMaxPatchCorners> of;
    std::size_t count = 0;
    const Share* begin() const { return of.data(); }
    const Share* end() const { return of.data() + count; }
  };

  CellField() = default;
  /// All values 0. The cells' elements are `usable` or not.
  CellField(LayeredMesh cells, const Scene& scene, const std::vector<char>& usable,
            Eigen::Index bands);

  const LayeredMesh& cells() const { return cells_; }
  const std::vector<Node>& nodes() const { return nodes_; }
  /// Of a cell's corners; kNone where it has none.
  std::uint32_t node_of(const Patch& cell, std::size_t corner) const {
    return node_of_[cell.first_corner + corner];
  }
  /// The cell of element `patch` that holds a point (the nearest one if none does).
  std::uint32_t find_cell(std::uint32_t patch, const Vec3& point) const;
  /// What the value at a point of a cell is made of.
  Shares shares_at(std::uint32_t cell, const Vec3& point) const;
  /// Adds the value at a point of a cell.
  void add_to(std::uint32_t cell, const Vec3& point, Eigen::Ref<Eigen::VectorXd> values) const;

  /// nodes x bands; after changing those of some nodes, `tie_hanging`.
  BandMatrix values;
  /// Gives hanging nodes their places between others; any nodes x bands.
  void tie_hanging(BandMatrix& of_nodes) const;

 private:
  struct Hanging {
    std::uint32_t node, from, to;
    double share;
  };
  LayeredMesh cells_;
  std::vector<std::uint32_t> node_of_;  // for each entry of cells_.mesh.corners
  std::vector<Node> nodes_;
  std::vector<Hanging> hanging_;
};

}  // namespace truebox

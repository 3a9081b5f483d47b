// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "mesh/patch_mesh.h"

namespace truebox {

/// Which elements share an edge or a vertex, where larger meet smaller ones as well. Elements on
/// two sides of a contact line share neither: a block, or a wall too thin to bury anything, keeps
/// its two sides apart.
class PatchTopology {
 public:
  explicit PatchTopology(const PatchMesh& mesh);

  /// The elements across the edge from corner k of element `patch` to the next: several where they
  /// are smaller, none at the rim of a piece or where a contact line runs along the edge.
  std::span<const std::uint32_t> across(std::uint32_t patch, std::size_t k) const;

  /// Usable elements within `rings` vertex rings of a vertex that can be reached from `start` over
  /// edges between usable elements; sorted.
  std::vector<std::uint32_t> reachable(const std::vector<char>& usable, std::uint32_t start,
                                       std::uint32_t vertex, int rings) const;

  /// A corner that hangs inside the edge of a larger element must take that element's value there,
  /// (1 - share) of corner `from` and share of corner `to`. All three are entries of mesh.corners.
  struct Constraint {
    std::uint32_t corner = 0, from = 0, to = 0;
    double share = 0.0;
  };
  /// Those between usable elements, each after all that its own `from` and `to` depend on.
  std::vector<Constraint> constraints(const std::vector<char>& usable) const;

 private:
  const PatchMesh* mesh_;
  std::vector<std::vector<std::uint32_t>> patches_at_;  // vertex -> elements
  std::vector<std::vector<std::uint32_t>> across_;      // entry of mesh.corners -> elements
  std::vector<Constraint> constraints_;                 // every hanging corner once
};

}  // namespace truebox

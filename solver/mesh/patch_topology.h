// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <map>
#include <utility>
#include <vector>

#include "mesh/patch_mesh.h"

namespace truebox {

/// Which elements share an edge or a vertex. Elements on two sides of a contact line share neither:
/// a block, or a wall too thin to bury anything, keeps its two sides apart.
class PatchTopology {
 public:
  static constexpr std::uint32_t kNone = ~0u;

  explicit PatchTopology(const PatchMesh& mesh);

  /// The element across the edge from corner k of element `patch` to the next; kNone if there is
  /// none, or if a contact line runs along it.
  std::uint32_t across(std::uint32_t patch, std::size_t k) const;

  /// Usable elements within `rings` vertex rings of a vertex that can be reached from `start` over
  /// edges between usable elements; sorted.
  std::vector<std::uint32_t> reachable(const std::vector<char>& usable, std::uint32_t start,
                                       std::uint32_t vertex, int rings) const;

 private:
  using Edge = std::pair<std::uint32_t, std::uint32_t>;
  const PatchMesh* mesh_;
  std::vector<std::vector<std::uint32_t>> patches_at_;  // vertex -> elements
  std::map<Edge, std::array<std::uint32_t, 2>> patches_along_;
};

}  // namespace truebox

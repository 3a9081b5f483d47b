// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "mesh/patch_mesh.h"

namespace truebox {

/// A vertex of smaller elements inside an edge of a larger one: a T-vertex, or hanging node.
struct HangingVertex {
  std::uint32_t vertex = 0;
  std::uint32_t patch = 0;   ///< the larger element
  std::uint32_t corner = 0;  ///< whose edge runs from this corner to the next
  double share = 0.0;        ///< of the way along that edge, in (0, 1)
};

/// All of them, within each piece, by their places (1e-8 of the piece's diameter); those of one
/// edge stand together, in the order along it. A field is continuous there only if its value at the
/// vertex is what the larger element says: SmoothField and VertexRadiosity see to it.
/// Source: Baum, Mann, Smith & Winget (1991).
std::vector<HangingVertex> hanging_vertices(const PatchMesh& mesh);

/// The same among the elements that are `shown` (one flag an element) and between all pieces: where
/// the elements of two walls meet in an edge of the scene, or a block stands on a floor, each side
/// has vertices that the other lacks. `places[v]` is the vertex that stands for all at the place of
/// v: triangles through these are watertight, whatever the piece. Places are equal within 1e-8 of
/// the mesh's size.
struct Seams {
  std::vector<HangingVertex> hanging;
  std::vector<std::uint32_t> places;
};
Seams seams(const PatchMesh& mesh, const std::vector<char>& shown);

}  // namespace truebox

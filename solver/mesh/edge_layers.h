// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "mesh/patch_mesh.h"

namespace truebox {

/// A mesh whose elements are cut into thinner and thinner cells towards the lines where surfaces
/// meet. Cells of one element stand together; pieces keep their numbers.
struct LayeredMesh {
  PatchMesh mesh;
  std::vector<std::uint32_t> parent;      ///< of each cell: the element it was cut from
  std::vector<std::uint32_t> first_cell;  ///< of each element; one more ends the last
};

/// The elements of a mesh cut into cells: `cells_of[i]`, convex polygons, cover element i.
LayeredMesh layered_mesh(const PatchMesh& mesh, const std::vector<std::vector<Polygon>>& cells_of);

/// Where other surfaces that face a piece meet it, along its rim or across it: there radiosity
/// behaves like B0 + c x^lambda. Openings do not count: nothing comes from them.
std::vector<ContactLine> meeting_lines(const PatchMesh& mesh, const Scene& scene,
                                       std::uint32_t piece);

/// Cuts the elements within h of each meeting line (h: the extent across of those that touch it) at
/// distances h/2, h/4, ..., h/2^layers: on cells whose width is half their distance, linear
/// interpolation of x^lambda is good to c d^lambda (1 - lambda) / 30. Lines that end inside a piece
/// are prolonged by h, so that the corners of a block's foot get small cells in both directions.
/// Elements that are not `usable`, and those of openings, stay whole.
LayeredMesh edge_layers(const PatchMesh& mesh, const Scene& scene, const std::vector<char>& usable,
                        int layers);

}  // namespace truebox

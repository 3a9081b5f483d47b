// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "mesh/patch_mesh.h"

namespace truebox {

/// Appends a piece of a surface to the mesh, its elements in the order of `cells`: convex polygons
/// that cover it. Corners within 2e-8 of the piece's diameter become one vertex.
void add_piece(PatchMesh& mesh, std::size_t surface, const Polygon& polygon,
               std::vector<ContactLine> contacts, const std::vector<Polygon>& cells);

}  // namespace truebox

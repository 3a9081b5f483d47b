// SPDX-License-Identifier: BSD-3-Clause
// Form factors of one row by brute force, to hold quick ones against.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "transport/pair_kernel.h"
#include "transport/visible_parts.h"

namespace truebox {

/// sum_j |F_ij - what 16 x 16 points of patch i see of j|: no planner, no solids, no kernel, every
/// polygon of the scene a blocker of its own; errors cannot cancel. A shadow's edge across a patch
/// is found to some 1/16^1.5 of what crosses it.
inline double row_difference(const PatchMesh& mesh, const std::vector<PlanarPolygon>& patches,
                             const Eigen::MatrixXd& exchange_area_m2, std::uint32_t i) {
  std::vector<Blocker> pieces;
  std::vector<const Blocker*> blockers;
  for (const Piece& piece : mesh.pieces) pieces.push_back({piece.polygon, piece.plane});
  for (std::size_t p = 0; p < pieces.size(); ++p)
    if (p != mesh.patches[i].piece) blockers.push_back(&pieces[p]);
  PatchPointBuffer buffer;
  const PatchPoints points = buffer.fill(patches[i], 16);
  VisibleParts parts;
  double sum_m2 = 0.0;
  for (std::size_t j = 0; j < patches.size(); ++j) {
    if (mesh.patches[j].piece == mesh.patches[i].piece) continue;
    double seen_m2 = 0.0;
    for (std::uint32_t k = 0; k < points.count; ++k)
      for (const Polygon& part :
           parts(points.at(k), patches[j].vertices, patches[j].plane, blockers))
        seen_m2 +=
            points.weight_at(k) * point_to_polygon(points.at(k), patches[i].plane.normal, part);
    sum_m2 += std::abs(exchange_area_m2(static_cast<Eigen::Index>(j), i) - seen_m2);
  }
  return sum_m2 / patches[i].area_m2;
}

}  // namespace truebox

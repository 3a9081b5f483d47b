// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "discontinuity/discontinuity_lines.h"
#include "mesh/cell_tree.h"
#include "transport/prediction.h"

namespace truebox {

struct DiscontinuityOptions {
  std::size_t cells = 400;  ///< about
  /// Of a line, where elements are as wide as `cells` makes uniform ones; relative to the luminous
  /// flux spread over all surfaces.
  double least_strength = 0.02;
  double apart = 0.3;  ///< lines that run closer are one, in widths of such an element
};

/// What became of the lines that are strong enough.
struct FollowedLines {
  std::size_t of_order[3] = {};  ///< D0, D1, D2 that the mesh follows, in parts at least
  std::size_t left_out = 0;      ///< for want of elements
};

/// Lines that a mesh may follow, of each piece of the scene's surfaces (all pieces in their order).
std::vector<std::vector<DiscontinuityLine>> lines_of_light(const Scene& scene,
                                                           const DiscontinuityOptions& options);

/// Elements that respect the lines of light and blocker edges: no line that is followed crosses
/// one. Pieces without a line get those of uniform_mesh. Few cells cannot follow many lines: the
/// weakest are left out then.
CellTree discontinuity_cells(const Scene& scene, const DiscontinuityOptions& options,
                             FollowedLines* followed = nullptr);

/// A prediction on three grids of about `options.elements` elements that follow the lines, each cut
/// in four.
std::unique_ptr<Prediction> predict_along_discontinuities(const Scene& scene,
                                                          const PredictOptions& options,
                                                          FollowedLines* followed = nullptr);

}  // namespace truebox

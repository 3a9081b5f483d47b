// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "adaptive/goal.h"
#include "discontinuity/discontinuity_mesh.h"
#include "mesh/cell_tree.h"
#include "scene/requirements.h"
#include "transport/form_factors.h"

namespace truebox {

struct AdaptOptions {
  std::size_t cells =
      400;  ///< when to stop; the finest grid of a prediction has four times as many
  Goal goal;
  bool discontinuities = false;  ///< start from elements that follow lines of light and shadow
  FormFactorOptions form_factors;
  std::uint64_t seed = 1;  ///< of the goal's random signs
};

/// How the mesh came about: one line a solve.
struct AdaptStep {
  std::size_t cells = 0;
  double indicated_error = 0.0;  ///< root of the sum of squares: relative error of the goal
};

/// A mesh that was refined where the goal's error comes from, and its coarser forebear.
struct AdaptedMesh {
  CellTree fine;    ///< `cells` of them
  CellTree coarse;  ///< about a quarter as many, an earlier state of the same mesh
  std::vector<AdaptStep> steps;
  FollowedLines lines;  ///< that the first mesh follows, and so all
};

/// Starts from few cells and halves those, each in its better direction, where that lowers the
/// squared error of the goal most (cell_errors), a part of them at a time, until there are enough.
/// At most kBands of the scene's bands are looked at. The scene must outlive the result.
AdaptedMesh adapt_mesh(const Scene& scene, const AdaptOptions& options);

}  // namespace truebox

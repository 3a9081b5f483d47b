// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "mesh/patch_mesh.h"
#include "mesh/smooth_field.h"
#include "radiometry/progress.h"
#include "transport/closure_repair.h"
#include "transport/visibility.h"

namespace truebox {

/// How the visible share of a pair that something may stand between is found.
enum class FormFactorMethod {
  ray_casting,      ///< quasi-random rays: with noise, which several seeds can tell apart
  exact_visibility  ///< outlines of the shadows from nine points of a patch: no noise
};

struct FormFactorOptions {
  FormFactorMethod method = FormFactorMethod::exact_visibility;
  double relative_tolerance = 1e-5;  ///< of the unoccluded kernel, each pair
  bool occlusion = true;             ///< false where the scene cannot block (see Requirements)
  int rays = 16;  ///< ray_casting: of a partly hidden pair; at least 4, not a multiple of 7
  int outline_points = 3;  ///< exact_visibility: 2, 3 or 4, squared, on a patch of a hidden pair
  ClosureRepair repair = ClosureRepair::scaling;  ///< of closed scenes
  std::uint64_t seed = 1;
  std::size_t memory_limit_bytes = std::size_t{8} << 30;
  Progress progress;
};

/// How the factors were found and how well they close.
struct FormFactorSummary {
  FormFactorMethod method = FormFactorMethod::exact_visibility;
  std::size_t pairs_unoccluded = 0, pairs_hidden = 0, pairs_sampled = 0;
  std::size_t rays = 0;
  std::size_t buried_patches = 0;   ///< lie under another surface and see nothing
  std::size_t covered_patches = 0;  ///< lie partly under one: their free part counts
  bool closed = false;              ///< no ray of the closure test escaped
  std::size_t closure_rays = 0;
  double closure_error_max = 0.0;   ///< max |sum_j F_ij - 1| before repair (closed scenes)
  double closure_error_mean = 0.0;  ///< its area-weighted mean; of a matrix, root mean square
  ClosureRepair repair = ClosureRepair::scaling;
  double repair_max = 0.0;            ///< largest relative change of a sampled factor
  double repair_rms = 0.0;            ///< of a matrix: over all sampled factors
  std::size_t repair_negative = 0;    ///< of a matrix: factors that came out below 0 and are 0 now
  double closure_residual_max = 0.0;  ///< max |sum_j F_ij - 1| after repair
  double row_sum_max = 0.0;           ///< max sum_j F_ij as used
  int streamed_passes = 0;            ///< over all pairs, before the solve, where they are not kept
};

/// All pairs of a mesh as one symmetric matrix of exchange areas S_ij = A_i F_ij (m^2), n x n, so
/// that reciprocity holds by construction.
struct FormFactors {
  Eigen::MatrixXd exchange_area_m2;
  Eigen::VectorXd area_m2;   ///< what is free of each element, all of it but for few
  std::vector<char> usable;  ///< 0: buried
  FormFactorSummary summary;

  Eigen::Index size() const { return area_m2.size(); }
};

/// Throws std::length_error with the sizes if n^2 doubles exceed the memory limit.
void require_memory(std::size_t elements, const FormFactorOptions& options);

/// Analytic kernel times visible share. Pairs that no surface can come between (half-space and box
/// tests) take the kernel alone; the others are sampled by quasi-random ray pairs weighted with the
/// kernel. If the scene is closed, only sampled factors are scaled, symmetrically, until rows sum
/// to 1 (Sinkhorn), or changed as `repair` says; the summary says by how much.
/// exact_visibility: see exact_form_factors; what the nine points leave open is repaired likewise.
/// Sources: Sinkhorn & Knopp (1967); low-discrepancy recurrence: Roberts (2018).
/// Throws as require_memory.
FormFactors form_factors(const PatchMesh& mesh, const Scene& scene, const Visibility& visibility,
                         const FormFactorOptions& options);

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "planning/plan.h"

namespace truebox {

/// What a solve on one grid models; a plan leaves out what the scene does not need.
struct Model {
  bool occlusion = true;        ///< false: no test of what stands between
  bool every_pair = true;       ///< rays for all pairs that face each other, clear or not
  bool interreflection = true;  ///< false: direct light only
  bool every_band = true;       ///< false: bands that are multiples of others are scaled
  bool share_bands = false;     ///< bands on the basis of others
  double solver_bound = 1e-12;  ///< relative
};

/// The model that leaves nothing out, and the one that the scene needs.
inline Model full_model() { return {}; }
Model needed_model(const Plan& plan);

struct ModelSolution {
  BandMatrix radiosity;  ///< elements x bands, W m^-2 nm^-1
  std::size_t rays = 0, pairs_tested = 0, form_factors = 0, bands_solved = 0;
  double matrix_passes = 0.0;
  double processor_s = 0.0;
};

/// Solves on one mesh. Rays of `every_pair`: 16, weighted by the kernel; the others as form_factors
/// with exact visibility finds them.
ModelSolution solve_model(const Scene& scene, const PatchMesh& mesh, const Model& model);

/// One claim of a plan held to the answer of the model that does not make it, on the same elements.
struct ClaimCheck {
  std::string claim;
  std::string work;  ///< what is counted
  double planned_work = 0.0, full_work = 0.0;
  double planned_s = 0.0, full_s = 0.0;  ///< processor time
  /// Largest of an element and band, relative to that band's largest; of links rms over the area,
  /// relative to the mean.
  double difference = 0.0;
  double allowed = 0.0;  ///< what the plan says it can cause, at most
  std::string allowed_why;

  bool holds() const { return difference <= allowed; }
};

/// Every claim that the plan makes about this scene, on about `elements` uniform elements.
/// Radiosity only: empty for a scene that needs path tracing.
std::vector<ClaimCheck> check_claims(const Scene& scene, const Plan& plan, std::size_t elements);

}  // namespace truebox

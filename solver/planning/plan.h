// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "planning/mutual_visibility.h"
#include "planning/pilot.h"
#include "scene/requirements.h"

namespace truebox {

struct PlanRequest {
  /// A share: of what `measure` says, or standard error of a pixel where paths are traced.
  double target_error = 0.01;
  ErrorMeasure measure = ErrorMeasure::bound_of_means;
  /// What counts: nothing for all surfaces alike, else what the mesh is refined for.
  std::optional<Goal> goal;
  std::optional<CameraDescription> camera;  ///< whose picture is wanted
  /// Values are interpolated between corners of elements, as viewers of .vtu and .glb do.
  bool interpolated = false;
  bool means_only = false;  ///< of surfaces: no values at points are wanted
  std::size_t memory_limit_bytes = std::size_t{8} << 30;
  Progress progress;

  std::string invalid() const;  ///< why this cannot be asked; empty if it can
};

enum class PlannedMethod { direct_light, radiosity, path_tracing };
enum class PlannedMesh { uniform, adapted };
enum class PlannedExchange { none, full_matrix, streamed, hierarchical };

/// How far an error that a decision can cause is known.
enum class ErrorKind {
  none,      ///< exact: rounding only
  bound,     ///< it cannot be larger, as far as the bound of the solve itself holds
  estimate,  ///< it should be about this
  noise      ///< a standard error, k = 1
};

/// One thing decided: what is done, why, what is left out, what that saves and what it can cost.
struct Decision {
  std::string topic, choice, why{};
  std::string left_out{};     ///< empty where nothing is
  std::string work{};         ///< what is counted, such as "rays"; empty: nothing to count
  double planned_work = 0.0;  ///< with this decision
  double full_work = 0.0;     ///< of the model that leaves nothing out
  ErrorKind error_kind = ErrorKind::none;
  double error = 0.0;  ///< share of what `error_of` names
  std::string error_of{};

  double saving() const;  ///< full : planned; infinite where nothing is left to do, 1 if uncounted
};

/// What a scene requires for a requested error, decided from its geometry and materials by exact
/// tests, and from a small pilot solve where a number has to be foretold.
struct Plan {
  Requirements needs;
  MutualVisibility::Shares sight;
  std::optional<MutualVisibility> visibility;  ///< which surface sees which, if not too many
  std::optional<Pilot> pilot;                  ///< none for scenes too large for one
  std::optional<PathPilot> path_pilot;

  double target_error = 0.0;                            ///< as requested,
  ErrorMeasure measure = ErrorMeasure::bound_of_means;  ///< as this
  PlannedMethod method = PlannedMethod::radiosity;
  PlannedMesh mesh = PlannedMesh::uniform;
  PlannedExchange exchange = PlannedExchange::full_matrix;
  FormFactorMethod form_factors = FormFactorMethod::ray_casting;
  bool discontinuities = false;  ///< elements follow lines of light
  int degree = 0;                ///< of polynomials on an element; 0: constants
  std::size_t elements = 0;
  double solver_bound = 1e-7;
  double link_tolerance = 0.0;   ///< hierarchical
  int paths = 0;                 ///< a pixel
  std::size_t bands_solved = 0;  ///< by themselves, not from products of others
  double processor_s = 0.0;      ///< estimate, to a factor of three; 0: unknown
  std::size_t bytes = 0;         ///< of form factors or links

  std::vector<Decision> decisions;
};

/// std::invalid_argument if request.invalid().
Plan make_plan(const Scene& scene, const PlanRequest& request);

}  // namespace truebox

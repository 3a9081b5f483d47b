// SPDX-License-Identifier: BSD-3-Clause
#include "plan_settings.h"

#include <fmt/format.h>

#include <algorithm>

#include "radiometry/input_error.h"
#include "scene/requirements.h"
#include "solve_basis.h"

namespace truebox::app {
namespace {

constexpr char kDefaultTarget[] = "1%";
const std::string kCameraGoal = "camera:";

// The camera whose picture is wanted: that of the goal, or the only one.
std::optional<CameraDescription> camera_of(const Scene& scene, const std::string& goal) {
  if (goal.starts_with(kCameraGoal)) return find_camera(scene, goal.substr(kCameraGoal.size()));
  if (scene.cameras.size() == 1) return scene.cameras.begin()->second;
  return std::nullopt;
}

Goal goal_of(const Scene& scene, const std::string& name) {
  try {
    return goal_of_name(name, scene);
  } catch (const std::invalid_argument& error) {
    throw InputError("the goal of the plan", 0, "a goal that this scene has", error.what());
  }
}

}  // namespace

Plan plan_for(const Scene& scene, const PredictionArguments& wished) {
  PlanRequest request;
  request.target_error =
      *share_of(wished.target_error.empty() ? kDefaultTarget : wished.target_error);
  request.memory_limit_bytes = wished.memory_MiB << 20;
  request.progress = terminal_progress(wished.quiet);
  request.interpolated = wished.interpolated;
  request.means_only = wished.means_only;
  request.camera = camera_of(scene, wished.automatic);
  if (!wished.automatic.empty() && wished.automatic != kDefaultGoal)
    request.goal = goal_of(scene, wished.automatic);
  if (request.goal && request.goal->kind == Goal::Kind::irradiance)
    request.measure = ErrorMeasure::rms_irradiance;
  return make_plan(scene, request);
}

PredictionArguments applied(const Plan& plan, const PredictionArguments& wished) {
  PredictionArguments a = wished;
  a.automatic.clear();
  if (plan.method == PlannedMethod::path_tracing) {
    a.method = "path";
    return a;
  }
  if (a.target_error.empty()) a.target_error = kDefaultTarget;
  a.elements = plan.elements;
  if (plan.degree > 0) {
    a.basis = basis_names()[static_cast<std::size_t>(plan.degree)];
    return a;
  }
  a.relative_bound = plan.solver_bound;
  if (plan.exchange == PlannedExchange::hierarchical) {
    a.form_factors = "hierarchical";
    a.link_tolerance = plan.link_tolerance;
    a.target_error.clear();  // links bound nothing: there is no target to reach
  } else if (plan.exchange == PlannedExchange::streamed) {
    a.form_factors = "streamed";
  } else if (plan.exchange == PlannedExchange::full_matrix) {
    a.form_factors = plan.form_factors == FormFactorMethod::exact_visibility ? "exact-visibility"
                                                                             : "ray-casting";
  }
  if (plan.measure == ErrorMeasure::rms_irradiance)
    a.target_error.clear();  // that is a target of means; this one was foretold
  a.discontinuities = plan.discontinuities;
  if (plan.mesh == PlannedMesh::adapted)
    a.adaptive = wished.automatic.empty() ? kDefaultGoal : wished.automatic;
  return a;
}

std::string command_line(const Plan& plan, const PredictionArguments& a) {
  const PredictionArguments usual;
  std::string line = fmt::format(
      "truebox {} {}", plan.method == PlannedMethod::path_tracing ? "render" : "solve", a.scene);
  if (plan.method == PlannedMethod::path_tracing)
    return line + fmt::format(" --method path --samples {} -o FILE.exr", std::max(16, plan.paths));
  if (a.basis != usual.basis) line += " --basis " + a.basis;
  line += fmt::format(" --elements {}", a.elements);
  if (!a.target_error.empty()) line += " --target-error " + a.target_error;
  if (a.form_factors != usual.form_factors) line += " --form-factors " + a.form_factors;
  if (a.form_factors == "hierarchical")
    line += fmt::format(" --link-tolerance {:g}", a.link_tolerance);
  if (a.relative_bound != usual.relative_bound)
    line += fmt::format(" --solver-bound {:g}", a.relative_bound);
  if (!a.adaptive.empty())
    line += a.adaptive == kDefaultGoal ? " --adaptive" : " --adaptive=" + a.adaptive;
  if (a.discontinuities) line += " --discontinuities";
  if (a.bands > 0) line += fmt::format(" --bands {}", a.bands);
  if (a.memory_MiB != usual.memory_MiB) line += fmt::format(" --memory {}", a.memory_MiB);
  return line;
}

PredictionArguments planned(const Scene& scene, const PredictionArguments& wished,
                            std::string& line) {
  require_lambertian(scene);
  const Plan plan = plan_for(scene, wished);
  const PredictionArguments a = applied(plan, wished);
  line = command_line(plan, a);
  return a;
}

}  // namespace truebox::app

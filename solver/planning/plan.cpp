// SPDX-License-Identifier: BSD-3-Clause
#include "planning/plan.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "planning/plan_text.h"
#include "planning/planner.h"
#include "transport/prediction.h"

namespace truebox {

using plan_text::count;
using plan_text::percent;

namespace {

constexpr std::size_t kPilotElements = 1000;
constexpr std::size_t kLargestPilot = 4000;  // where the smallest three grids are larger: none
constexpr std::size_t kGridsOfAPiece = 16;   // elements of a piece that three nested grids take
constexpr double kSolverShare = 1e-3;        // of the target, as predict_to_target takes

double facing_pairs(const Pilot& pilot) {
  const FormFactorSummary& f = pilot.form_factors;
  return static_cast<double>(f.pairs_unoccluded + f.pairs_hidden + f.pairs_sampled);
}

}  // namespace

Plan Planner::make() {
  plan_.needs = requirements(scene_);
  plan_.measure = request_.measure;
  plan_.target_error = request_.target_error;
  MutualVisibility visibility(scene_);
  plan_.sight = visibility.shares();
  if (visibility.is_complete()) plan_.visibility = std::move(visibility);
  if (plan_.needs.path_tracing) {
    plan_paths();
  } else if (!plan_.needs.interreflection) {
    plan_direct();
  } else {
    plan_radiosity();
  }
  return std::move(plan_);
}

void Planner::plan_paths() {
  plan_.method = PlannedMethod::path_tracing;
  plan_.exchange = PlannedExchange::none;
  plan_.bands_solved = scene_.bands.size();
  const std::string& reason = plan_.needs.reasons.front();  // "path tracing: needed, surface ..."
  Decision d{"method", "path tracing", reason.substr(reason.find(", ") + 2)};
  d.left_out = "nothing; form factors cannot describe such a surface";
  d.error_kind = ErrorKind::noise;
  d.error = request_.target_error;
  d.error_of = "radiance of a pixel, median";
  if (request_.camera) {
    plan_.path_pilot = fly_path_pilot(scene_, *request_.camera);
    const PathPilot& pilot = *plan_.path_pilot;
    if (pilot.standard_error > 0.0)
      plan_.paths = static_cast<int>(
          std::min(1e9, std::ceil(pilot.paths_for(request_.target_error) / 16.0) * 16.0));
    const double pixels =
        static_cast<double>(request_.camera->pixels[0]) * request_.camera->pixels[1];
    plan_.processor_s = pilot.processor_s * pixels / pilot.pixels * plan_.paths / pilot.paths;
  }
  add(std::move(d));
  Decision bands{"bands", "all " + count(scene_.bands.size()) + " along the same paths",
                 "geometry is traced once; glass that disperses sends a path on in one band"};
  add(std::move(bands));
}

void Planner::plan_direct() {
  plan_.method = PlannedMethod::direct_light;
  plan_.exchange = PlannedExchange::none;
  plan_.elements = std::max<std::size_t>(
      kPilotElements, static_cast<std::size_t>(Prediction::kPatchesAPiece) * pieces());
  decide_occlusion(0.0, 0.0);
  Decision d{"interreflection", "left out", "no reflecting surface faces another"};
  d.left_out = "form factors and the system of equations";
  d.work = "pairs of elements";
  d.full_work = pairs(static_cast<double>(plan_.elements));
  add(std::move(d));
  decide_bands(0, 0.0);
}

void Planner::plan_radiosity() {
  plan_.solver_bound = std::clamp(kSolverShare * request_.target_error, 1e-12, 1e-7);
  plan_.form_factors = FormFactorMethod::exact_visibility;
  if (kGridsOfAPiece * pieces() <= kLargestPilot) fly(std::nullopt);
  decide_method();
  if (!choose_polynomials()) {
    decide_mesh();
    decide_lines();
    decide_basis();
    decide_exchange();
  }
  const Pilot* pilot = plan_.pilot ? &*plan_.pilot : nullptr;
  decide_occlusion(pilot ? static_cast<double>(pilot->form_factors.pairs_sampled) : 0.0,
                   pilot ? facing_pairs(*pilot) : 0.0);
  decide_form_factors();
  decide_bands(pilot ? pilot->bands_reduced : 0, plan_.solver_bound);
  decide_solver();
  if (pilot) {
    Decision d{"interreflection", "modelled", "reflecting surfaces face each other"};
    d.error_of = "irradiance";
    d.why += "; " + percent(pilot->indirect_share) + " of the light comes by reflection";
    add(std::move(d));
  }
}

PredictOptions Planner::pilot_options() const {
  PredictOptions options;
  options.elements = std::max(kPilotElements, kGridsOfAPiece * pieces());
  options.form_factors.method = plan_.form_factors;
  options.solve.relative_bound = plan_.solver_bound;
  options.progress = request_.progress;
  return options;
}

void Planner::fly(const std::optional<Goal>& goal) {
  plan_.pilot = fly_pilot(scene_, pilot_options(), goal, request_.measure);
}

void Planner::decide_method() {
  add({"method", "radiosity", "every surface is Lambertian and opaque", "", "", 0.0, 0.0,
       ErrorKind::none, 0.0, "light transport between such surfaces"});
}

std::size_t Planner::pieces() const {
  std::size_t n = 0;
  for (const Surface& surface : scene_.surfaces) n += surface.pieces.size();
  return n;
}

double Planner::least_elements() const {
  return Prediction::kPatchesAPiece * static_cast<double>(pieces());
}

double Decision::saving() const {
  if (work.empty() || full_work <= 0.0) return 1.0;
  return planned_work > 0.0 ? full_work / planned_work : std::numeric_limits<double>::infinity();
}

std::string PlanRequest::invalid() const {
  if (!(target_error > 0.0 && target_error < 1.0)) return "a target error lies between 0 and 1";
  return {};
}

Plan make_plan(const Scene& scene, const PlanRequest& request) {
  if (const std::string why = request.invalid(); !why.empty()) throw std::invalid_argument(why);
  return Planner(scene, request).make();
}

}  // namespace truebox

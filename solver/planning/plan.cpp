// SPDX-License-Identifier: BSD-3-Clause
#include "planning/plan.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>

#include "hierarchy/hierarchical_exchange.h"
#include "transport/prediction.h"

namespace truebox {
namespace {

constexpr std::size_t kPilotElements = 1000;
constexpr std::size_t kLargestPilot = 4000;   // where the smallest three grids are larger: none
constexpr std::size_t kGridsOfAPiece = 16;    // elements of a piece that three nested grids take
constexpr double kAdaptingPaysFrom = 1500.0;  // elements; measured, solver/README.md
constexpr double kSolverShare = 1e-3;         // of the target, as predict_to_target takes
constexpr double kCoarseLinks = 0.1, kFineLinks = 1e-2;
constexpr double kStreamedMatrices =
    40.0;  // what passes over rows made anew take; solver/README.md
constexpr double kStreamingPatience_s = 600.0;  // of processor time; longer, and links are better
constexpr double kLinksBound = 3.0;             // what a bound holds of the links' own estimate

class Planner {
 public:
  Planner(const Scene& scene, const PlanRequest& request) : scene_(scene), request_(request) {}

  Plan make() {
    plan_.needs = requirements(scene_);
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

 private:
  void add(Decision decision) { plan_.decisions.push_back(std::move(decision)); }

  void plan_paths() {
    plan_.method = PlannedMethod::path_tracing;
    plan_.exchange = PlannedExchange::none;
    plan_.bands_solved = scene_.bands.size();
    Decision d{"method", "path tracing", plan_.needs.reasons.front()};
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

  void plan_direct() {
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

  void plan_radiosity() {
    plan_.solver_bound = std::clamp(kSolverShare * request_.target_error, 1e-12, 1e-7);
    plan_.form_factors = FormFactorMethod::exact_visibility;
    if (kGridsOfAPiece * pieces() <= kLargestPilot) fly(std::nullopt);
    decide_method();
    decide_mesh();
    decide_basis();
    decide_exchange();
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

  PredictOptions pilot_options() const {
    PredictOptions options;
    options.elements = std::max(kPilotElements, kGridsOfAPiece * pieces());
    options.form_factors.method = plan_.form_factors;
    options.solve.relative_bound = plan_.solver_bound;
    options.progress = request_.progress;
    return options;
  }

  void fly(const std::optional<Goal>& goal) {
    plan_.pilot = fly_pilot(scene_, pilot_options(), goal);
  }

  void decide_method() {
    add({"method", "radiosity", "every surface is Lambertian and opaque", "", "", 0.0, 0.0,
         ErrorKind::none, 0.0, "light transport between such surfaces"});
  }

  void decide_mesh() {
    if (!plan_.pilot) {
      plan_.elements = static_cast<std::size_t>(Prediction::kPatchesAPiece) * pieces();
      Decision d{"mesh", "uniform, " + count(plan_.elements) + " elements",
                 "so many resolve each of " + count(pieces()) +
                     " pieces on three grids; too many for a pilot, so the error is not foretold"};
      d.error_kind = ErrorKind::estimate;
      d.error = std::numeric_limits<double>::quiet_NaN();
      d.error_of = "mean irradiance of a surface";
      add(std::move(d));
      return;
    }
    const Pilot uniform = *plan_.pilot;
    const double least = Prediction::kPatchesAPiece * static_cast<double>(pieces());
    double wanted = std::max(uniform.elements_for(request_.target_error), least);
    const double uniform_elements = wanted;
    std::string why = "the pilot's bound of " + percent(uniform.relative_bound) + " with " +
                      count(uniform.elements) + " elements falls like elements^(-3/4)";
    if (wanted <= kAdaptingPaysFrom) {
      why += "; an adapted mesh does not pay below " + count(kAdaptingPaysFrom) + " elements";
    } else {
      fly(request_.goal ? request_.goal : Goal{});
      const double adapted = std::max(plan_.pilot->elements_for(request_.target_error), least);
      const bool pays = request_.goal || plan_.pilot->processor_s_for(adapted) <
                                             uniform.processor_s_for(uniform_elements);
      why += "; adapted: " + percent(plan_.pilot->relative_bound) + " with " +
             count(plan_.pilot->elements) + " elements, so " + count(adapted) + " foretold and " +
             seconds(plan_.pilot->processor_s_for(adapted)) + " instead of " +
             count(uniform_elements) + " and " + seconds(uniform.processor_s_for(uniform_elements));
      if (pays) {
        plan_.mesh = PlannedMesh::adapted;
        wanted = adapted;
      } else {
        plan_.pilot = uniform;
      }
    }
    double error = wanted > least ? request_.target_error
                                  : std::min(request_.target_error, plan_.pilot->bound_for(wanted));
    const double fits =
        std::floor(std::sqrt(static_cast<double>(request_.memory_limit_bytes) / sizeof(double)));
    const double streamed_s = kStreamedMatrices * uniform.processor_s_for(uniform_elements);
    if (wanted > fits && streamed_s <= kStreamingPatience_s) {
      plan_.exchange = PlannedExchange::streamed;
      plan_.mesh = PlannedMesh::uniform;
      plan_.pilot = uniform;
      wanted = uniform_elements;
    } else if (wanted > fits && fits > least &&
               plan_.pilot->bound_for(fits) < kLinksBound * request_.target_error) {
      error = plan_.pilot->bound_for(fits);
      why += "; " + count(wanted) + " do not fit the memory, " + count(fits) +
             " do and are not foretold to meet the target";
      wanted = fits;
    }
    plan_.elements = static_cast<std::size_t>(std::min(wanted, 1e9));
    plan_.processor_s = plan_.exchange == PlannedExchange::streamed
                            ? streamed_s
                            : plan_.pilot->processor_s_for(wanted);
    const bool is_adapted = plan_.mesh == PlannedMesh::adapted;
    Decision d{"mesh",
               (is_adapted ? "adapted, " : "uniform, ") + count(plan_.elements) + " elements",
               std::move(why)};
    d.left_out = is_adapted ? "small elements where the light is even" : "adaptive subdivision";
    if (plan_.needs.occlusion) d.left_out += ", elements along lines of shadow (--discontinuities)";
    d.work = "elements";
    d.planned_work = wanted;
    d.full_work = uniform_elements;
    d.error_kind = ErrorKind::bound;
    d.error = mesh_error_ = error;
    d.error_of = "mean irradiance of a surface";
    add(std::move(d));
  }

  // Measured orders: tests/verification/basis_convergence_test.cpp.
  void decide_basis() {
    Decision d{"basis", "constants, and a continuous field of quadratics between them", ""};
    d.why =
        plan_.needs.occlusion
            ? "light has kinks at shadows, where a higher degree gains nothing on elements that "
              "do not follow them"
            : "edges where surfaces meet leave every degree of first order on even elements; "
              "means, which are bound here, converge twice as fast";
    d.left_out = "polynomials of degree 1 to 4 (solve --basis, where nothing is hidden)";
    d.error_kind = ErrorKind::bound;
    d.error = plan_.pilot ? mesh_error_ : std::numeric_limits<double>::quiet_NaN();
    d.error_of = "mean irradiance of a surface, together with the mesh";
    add(std::move(d));
  }

  void decide_exchange() {
    const double n = static_cast<double>(plan_.elements);
    const double matrix_bytes = n * n * sizeof(double);
    Decision d{"exchange", "", ""};
    d.work = "MiB";
    d.full_work = matrix_bytes / (1 << 20);
    if (matrix_bytes <= static_cast<double>(request_.memory_limit_bytes)) {
      plan_.bytes = static_cast<std::size_t>(matrix_bytes);
      d.choice = "full matrix, " + mebibytes(matrix_bytes);
      d.why = "fits the limit of " + mebibytes(static_cast<double>(request_.memory_limit_bytes)) +
              ", and its bound is one; that of links is an estimate";
      d.planned_work = d.full_work;
    } else if (plan_.exchange == PlannedExchange::streamed) {
      plan_.bytes = static_cast<std::size_t>(3.0 * n * sizeof(double) *
                                             static_cast<double>(scene_.bands.size()));
      d.choice = "streamed: rows made anew for each pass, about " +
                 mebibytes(static_cast<double>(plan_.bytes));
      d.why = "a matrix takes " + mebibytes(matrix_bytes) + ", above the limit of " +
              mebibytes(static_cast<double>(request_.memory_limit_bytes)) +
              "; without it the passes take " + seconds(plan_.processor_s) +
              ", and the bound stays one";
      d.left_out = "the matrix";
      d.planned_work = static_cast<double>(plan_.bytes) / (1 << 20);
    } else {
      plan_.exchange = PlannedExchange::hierarchical;
      plan_.mesh = PlannedMesh::uniform;
      // Without a pilot nobody knows what finer links are worth beside the grid's own error.
      plan_.link_tolerance =
          plan_.pilot ? std::clamp(request_.target_error, kFineLinks, kCoarseLinks) : kCoarseLinks;
      HierarchyOptions options{plan_.link_tolerance, request_.memory_limit_bytes};
      if (estimated_bytes(plan_.elements, options) > request_.memory_limit_bytes)
        plan_.link_tolerance = options.relative_tolerance = kCoarseLinks;
      plan_.bytes = estimated_bytes(plan_.elements, options);
      d.choice = "hierarchical, links of " + percent(plan_.link_tolerance) + ", about " +
                 mebibytes(static_cast<double>(plan_.bytes));
      d.why = "a matrix takes " + mebibytes(matrix_bytes) + ", above the limit of " +
              mebibytes(static_cast<double>(request_.memory_limit_bytes));
      d.left_out = "what is too faint to be worth a link of its own";
      d.planned_work = static_cast<double>(plan_.bytes) / (1 << 20);
      d.error_kind = ErrorKind::estimate;
      d.error = plan_.link_tolerance;
      d.error_of = "irradiance, rms over the area";
      plan_.processor_s = 0.0;  // the pilot's law is that of a matrix
    }
    add(std::move(d));
  }

  // Of the pilot's elements, carried over to the planned number.
  void decide_occlusion(double partial, double facing) {
    const double grown = plan_.pilot ? pairs(static_cast<double>(plan_.elements)) /
                                           pairs(static_cast<double>(plan_.pilot->elements))
                                     : 0.0;
    const std::string matrix =
        (plan_.visibility ? "" : "of " + count(plan_.sight.pairs) + " sampled pairs of pieces ") +
        percent(plan_.sight.share(plan_.sight.full)) +
        (plan_.visibility ? " of the pairs of pieces" : "") + " see each other in full, " +
        percent(plan_.sight.share(plan_.sight.partial)) + " perhaps partly, " +
        percent(plan_.sight.share(plan_.sight.hidden)) + " are hidden, " +
        percent(plan_.sight.share(plan_.sight.facing_away)) + " turn their backs";
    Decision d{"occlusion", "", ""};
    d.error_of = "visibility";
    if (!plan_.needs.occlusion) {
      d.choice = "left out";
      d.why = "every surface has the whole scene on one side";
      d.left_out = "all tests of what stands between two elements";
    } else {
      d.choice = "modelled where shafts leave it open";
      d.why = matrix;
      d.left_out = "tests of pairs that a shaft shows to be clear or closed";
    }
    if (facing > 0.0) {
      d.work = "pairs of elements tested for shadow";
      d.planned_work = grown * partial;
      d.full_work = grown * facing;
    }
    add(std::move(d));
  }

  void decide_form_factors() {
    Decision d{"form factors", "analytic",
               "nothing can stand between: closed forms and Gauss "
               "quadrature, no rays"};
    d.error_kind = ErrorKind::bound;
    d.error = 1e-5;
    d.error_of = "a form factor";
    if (plan_.exchange == PlannedExchange::hierarchical) {
      d.choice = "between groups of elements";
      d.why = "see exchange";
      d.error_kind = ErrorKind::estimate;
      d.error = plan_.link_tolerance;
      d.error_of = "irradiance, rms over the area";
    } else if (plan_.needs.occlusion) {
      d.choice = "outlines of the shadows";
      d.why = "without noise, and sooner than rays at the same error (solver/README.md)";
      d.left_out = "rays";
      d.error_kind = ErrorKind::estimate;
      d.error = plan_.pilot ? plan_.pilot->form_factors.closure_error_mean : 0.0;
      d.error_of = "row sums before they are scaled to one, rms, of the pilot";
    }
    add(std::move(d));
  }

  void decide_bands(int reduced, double solver_bound) {
    const std::size_t all = scene_.bands.size(), distinct = plan_.needs.distinct_bands.size();
    plan_.bands_solved = distinct - static_cast<std::size_t>(reduced);
    Decision d{"bands", count(plan_.bands_solved) + " of " + count(all) + " solved by themselves",
               ""};
    d.why = distinct == all ? "no two are multiples of each other"
                            : count(all - distinct) + " are exact multiples of others";
    if (distinct < all) d.left_out = "bands that are multiples of others";
    if (reduced > 0) {
      d.why += "; spectra are alike, so " + count(static_cast<std::size_t>(reduced)) +
               " are found from products of the others, each held to its own residual";
      d.left_out += std::string(d.left_out.empty() ? "" : ", and ") + "passes of their own";
      d.error_kind = ErrorKind::bound;
      d.error = solver_bound;
    }
    d.error_of = "radiosity";
    d.work = "bands by themselves";
    d.planned_work = static_cast<double>(plan_.bands_solved);
    d.full_work = static_cast<double>(all);
    add(std::move(d));
  }

  void decide_solver() {
    Decision d{"solver", "conjugate gradients to a bound of " + percent(plan_.solver_bound),
               "a thousandth of the target costs a few passes more than none"};
    d.left_out = "a factorisation";
    if (plan_.pilot) {
      d.work = "passes over the matrix";
      d.planned_work = plan_.pilot->matrix_passes;
      d.full_work = static_cast<double>(plan_.elements) / 3.0;  // n^3 / 3 a band
    }
    d.error_kind = ErrorKind::bound;
    d.error = plan_.solver_bound;
    d.error_of = "radiosity";
    add(std::move(d));
  }

  std::size_t pieces() const {
    std::size_t n = 0;
    for (const Surface& surface : scene_.surfaces) n += surface.pieces.size();
    return n;
  }

  static double pairs(double n) { return 0.5 * n * (n - 1.0); }
  static double facing_pairs(const Pilot& pilot) {
    const FormFactorSummary& f = pilot.form_factors;
    return static_cast<double>(f.pairs_unoccluded + f.pairs_hidden + f.pairs_sampled);
  }

  static std::string number(double value, const char* unit, int digits) {
    char text[64];
    std::snprintf(text, sizeof text, "%.*g%s", digits, value, unit);
    return text;
  }
  static std::string percent(double share) { return number(100.0 * share, " %", 2); }
  static std::string seconds(double s) { return number(s, " s", 2); }
  static std::string mebibytes(double bytes) {
    return std::to_string(std::llround(std::min(bytes, 1e18) / (1 << 20))) + " MiB";
  }
  static std::string count(double n) { return std::to_string(std::llround(std::min(n, 1e18))); }
  static std::string count(std::size_t n) { return std::to_string(n); }

  const Scene& scene_;
  const PlanRequest& request_;
  Plan plan_;
  double mesh_error_ = 0.0;
};

}  // namespace

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

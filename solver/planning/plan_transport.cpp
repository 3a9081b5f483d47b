// SPDX-License-Identifier: BSD-3-Clause
// What is worked out between elements, and how the system is solved.
#include "planning/plan_text.h"
#include "planning/planner.h"
#include "transport/polynomial_means.h"

namespace truebox {

using plan_text::count;
using plan_text::percent;

// Of the pilot's elements, carried over to the planned number.
void Planner::decide_occlusion(double partial, double facing) {
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

void Planner::decide_form_factors() {
  Decision d{"form factors", "analytic",
             "nothing can stand between: closed forms and Gauss "
             "quadrature, no rays"};
  d.error_kind = ErrorKind::bound;
  d.error = 1e-5;
  d.error_of = "a form factor";
  if (plan_.degree > 0) {
    d.choice = "moments of the kernel between polynomials";
    d.error = kernel_tolerance_for(request_.target_error);
    d.error_of = "a moment; the bound of the means holds what that does";
  } else if (plan_.exchange == PlannedExchange::hierarchical) {
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

void Planner::decide_bands(int reduced, double solver_bound) {
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

void Planner::decide_solver() {
  if (plan_.degree > 0) plan_.solver_bound = GalerkinOptions{}.relative_bound;
  Decision d{"solver", "conjugate gradients to a bound of " + percent(plan_.solver_bound),
             "a thousandth of the target costs a few passes more than none"};
  d.left_out = "a factorisation";
  if (plan_.degree > 0) d.why = "it costs next to nothing beside the moments";
  if (plan_.pilot && plan_.degree == 0) {
    d.work = "passes over the matrix";
    d.planned_work = plan_.pilot->matrix_passes;
    d.full_work = static_cast<double>(plan_.elements) / 3.0;  // n^3 / 3 a band
  }
  d.error_kind = ErrorKind::bound;
  d.error = plan_.solver_bound;
  d.error_of = "radiosity";
  add(std::move(d));
}

}  // namespace truebox

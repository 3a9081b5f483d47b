// SPDX-License-Identifier: BSD-3-Clause
// What elements.
#include <algorithm>
#include <cmath>
#include <limits>

#include "planning/line_pilot.h"
#include "planning/plan_text.h"
#include "planning/planner.h"

namespace truebox {

using plan_text::count;
using plan_text::percent;
using plan_text::seconds;

namespace {

constexpr double kAdaptingPaysFrom = 1500.0;  // elements; measured, solver/README.md
constexpr double kStreamedMatrices =
    40.0;  // what passes over rows made anew take; solver/README.md
constexpr double kStreamingPatience_s = 600.0;  // of processor time; longer, and links are better
constexpr std::size_t kLinePilotElements = 1600, kMostAlongLines = 40000;
constexpr double kLinesPayBelow = 0.8;  // of the error without: lines cost time and odd elements
constexpr double kLinksBound = 3.0;     // what a bound holds of the links' own estimate

}  // namespace

void Planner::decide_mesh_unforetold() {
  plan_.elements = static_cast<std::size_t>(least_elements());
  Decision d{"mesh", "uniform, " + count(plan_.elements) + " elements",
             "so many resolve each of " + count(pieces()) +
                 " pieces on three grids; too many for a pilot, so the error is not foretold"};
  d.error_kind = ErrorKind::estimate;
  d.error = std::numeric_limits<double>::quiet_NaN();
  d.error_of = "mean irradiance of a surface";
  add(std::move(d));
}

double Planner::elements_that_fit() const {
  return std::floor(std::sqrt(static_cast<double>(request_.memory_limit_bytes) / sizeof(double)));
}

void Planner::adapt_if_it_pays(const Pilot& uniform, MeshChoice& choice) {
  if (choice.elements <= kAdaptingPaysFrom) {
    choice.why += "; an adapted mesh does not pay below " + count(kAdaptingPaysFrom) + " elements";
    return;
  }
  fly(request_.goal ? request_.goal : Goal{});
  const double adapted =
      std::max(plan_.pilot->elements_for(request_.target_error), least_elements());
  const double adapted_s = plan_.pilot->processor_s_for(adapted);
  const double uniform_s = uniform.processor_s_for(choice.uniform_elements);
  choice.why += "; adapted: " + percent(plan_.pilot->error()) + " with " +
                count(plan_.pilot->elements) + " elements, so " + count(adapted) +
                " foretold and " + seconds(adapted_s) + " instead of " +
                count(choice.uniform_elements) + " and " + seconds(uniform_s);
  const bool alone_fits =
      choice.uniform_elements > elements_that_fit() && adapted <= elements_that_fit();
  if ((request_.goal && !is_rms()) || adapted_s < uniform_s || alone_fits) {
    plan_.mesh = PlannedMesh::adapted;
    choice.elements = adapted;
  } else {
    plan_.pilot = uniform;
  }
}

void Planner::fit_memory(const Pilot& uniform, MeshChoice& choice) {
  const double fits = elements_that_fit();
  const double streamed_s = kStreamedMatrices * uniform.processor_s_for(choice.uniform_elements);
  if (choice.elements > fits && streamed_s <= kStreamingPatience_s) {
    plan_.exchange = PlannedExchange::streamed;
    plan_.mesh = PlannedMesh::uniform;
    plan_.pilot = uniform;
    choice.elements = choice.uniform_elements;
  } else if (choice.elements > fits && fits > least_elements() &&
             plan_.pilot->error_for(fits) < kLinksBound * request_.target_error) {
    choice.error = plan_.pilot->error_for(fits);
    choice.why += "; " + count(choice.elements) + " do not fit the memory, " + count(fits) +
                  " do and are not foretold to meet the target";
    choice.elements = fits;
  }
  plan_.processor_s = plan_.exchange == PlannedExchange::streamed
                          ? streamed_s
                          : plan_.pilot->processor_s_for(choice.elements);
}

void Planner::decide_mesh() {
  if (!plan_.pilot) return decide_mesh_unforetold();
  const Pilot uniform = *plan_.pilot;
  MeshChoice choice;
  choice.uniform_elements = choice.elements =
      std::max(uniform.elements_for(request_.target_error), least_elements());
  choice.why =
      std::string("the pilot's ") + (is_rms() ? "rms error" : "bound") + " of " +
      percent(uniform.error()) + " with " + count(uniform.elements) + " elements" +
      (is_rms() ? ""
                : ", " + percent(uniform.bound_in_order) + " if its grids converge in order,") +
      " falls like elements^(" + (is_rms() ? "-0.6" : "-3/4") + ")";
  adapt_if_it_pays(uniform, choice);
  choice.error = choice.elements > least_elements()
                     ? request_.target_error
                     : std::min(request_.target_error, plan_.pilot->error_for(choice.elements));
  if (!is_rms() || !link_if_it_pays(uniform, choice)) fit_memory(uniform, choice);
  plan_.elements = static_cast<std::size_t>(std::min(choice.elements, 1e9));
  const bool is_adapted = plan_.mesh == PlannedMesh::adapted;
  Decision d{"mesh", (is_adapted ? "adapted, " : "uniform, ") + count(plan_.elements) + " elements",
             std::move(choice.why)};
  d.left_out = is_adapted ? "small elements where the light is even" : "adaptive subdivision";
  d.work = "elements";
  d.planned_work = choice.elements;
  d.full_work = choice.uniform_elements;
  d.error_kind = is_rms() ? ErrorKind::estimate : ErrorKind::bound;
  d.error = mesh_error_ = choice.error;
  d.error_of = error_name();
  add(std::move(d));
}

// What interpolates between corners shows lines of light where elements follow them: measured, not
// assumed, because few elements have no room for many lines.
void Planner::decide_lines() {
  if (!plan_.needs.occlusion) return;
  Decision d;
  d.topic = "lines of light";
  d.choice = "not followed";
  d.left_out = "elements along outlines of shadows (--discontinuities)";
  d.error_of = "irradiance interpolated between corners, rms over the area";
  if (!request_.interpolated) {
    d.why =
        "direct light is exact at every point and indirect light does not know them; files whose "
        "values are interpolated between corners gain (--interpolated)";
    return add(std::move(d));
  }
  if (!plan_.pilot || plan_.exchange == PlannedExchange::hierarchical ||
      plan_.elements > kMostAlongLines) {
    d.why = "too many elements or pieces to look for lines";
    d.error_kind = ErrorKind::estimate;
    d.error = std::numeric_limits<double>::quiet_NaN();
    return add(std::move(d));
  }
  const Goal goal = request_.goal ? *request_.goal : Goal{};
  const bool is_adapted = plan_.mesh == PlannedMesh::adapted;
  const LinePilot pilot = fly_line_pilot(scene_, std::min(plan_.elements, kLinePilotElements),
                                         is_adapted ? &goal : nullptr);
  plan_.discontinuities = pilot.error_along < kLinesPayBelow * pilot.error;
  d.why = "direct light interpolated between corners is off by " + percent(pilot.error) + " with " +
          count(pilot.elements) + " elements, by " + percent(pilot.error_along) + " with " +
          count(pilot.elements_along) + " that follow " + count(pilot.lines) + " lines";
  if (plan_.discontinuities) {
    d.choice = "followed by the elements";
    d.left_out.clear();
  }
  d.error_kind = ErrorKind::estimate;
  d.error = plan_.discontinuities ? pilot.error_along : pilot.error;
  d.error_of = "direct light interpolated between corners, rms over the area, with " +
               count(pilot.elements) + " elements";
  add(std::move(d));
}

}  // namespace truebox

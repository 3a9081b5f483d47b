// SPDX-License-Identifier: BSD-3-Clause
// What the radiosity is on an element.
#include <algorithm>
#include <cmath>
#include <limits>

#include "planning/plan_text.h"
#include "planning/planner.h"
#include "radiometry/processor_time.h"
#include "transport/polynomial_means.h"

namespace truebox {

using plan_text::count;
using plan_text::mebibytes;
using plan_text::percent;
using plan_text::seconds;

namespace {

constexpr double kNothingToGain_s = 0.5;  // what constants may take without a look at anything else
constexpr std::size_t kPilotElements = 24;
constexpr int kMostDegree = 4;
constexpr double kCostExponent = 1.6;  // of elements: measured on rooms, 32 to 214 of degree 1 to 3
constexpr double kReserve = 1.15;
const char* const kDegreeNames[] = {"constant", "linear", "quadratic", "cubic", "quartic"};

bool has_black_surface(const Scene& scene) {
  return std::any_of(scene.surfaces.begin(), scene.surfaces.end(), [&](const Surface& s) {
    const auto& rho = scene.material_of(s).reflectance.values;
    return !s.is_opening && *std::min_element(rho.begin(), rho.end()) <= 0.0;
  });
}

}  // namespace

std::string Planner::why_no_polynomials() const {
  if (plan_.needs.occlusion)
    return "light has kinks at shadows, where a higher degree gains nothing on elements that do "
           "not "
           "follow them";
  if (!request_.means_only || is_rms())
    return "values at points are wanted, and polynomials (solve --basis) give means of surfaces";
  if (has_black_surface(scene_))
    return "a surface reflects nothing, and polynomials do not find the light that falls on it";
  if (scene_.is_thermal) return "heat is wanted, and polynomials give means of radiosity";
  return {};
}

// A small solve on each degree, until one meets the target or takes as long as constants would.
std::optional<Planner::PolynomialChoice> Planner::fly_polynomials(double patience_s) const {
  std::optional<PolynomialChoice> best;
  for (int degree = 1; degree <= kMostDegree; ++degree) {
    PolynomialOptions options;
    options.degree = degree;
    options.elements = kPilotElements;
    options.kernel_tolerance = kernel_tolerance_for(request_.target_error);
    options.memory_limit_bytes = request_.memory_limit_bytes;
    const double start_s = process_cpu_s();
    const PolynomialMeans pilot = polynomial_means(scene_, options);
    const double pilot_s = process_cpu_s() - start_s;
    const double bound = pilot.largest_relative_bound();
    const double growth = std::max(
        1.0, kReserve * std::pow(bound / request_.target_error, 1.0 / bound_order(degree)));
    PolynomialChoice choice;
    choice.degree = degree;
    choice.pilot_elements = pilot.elements;
    choice.pilot_bound = bound;
    // What met the target will meet it again.
    const bool is_met = bound <= request_.target_error;
    choice.elements =
        is_met ? static_cast<double>(kPilotElements) : growth * static_cast<double>(pilot.elements);
    choice.unknowns = growth * static_cast<double>(pilot.unknowns);
    choice.processor_s = pilot_s * std::pow(growth, kCostExponent);
    if (8.0 * choice.unknowns * choice.unknowns <=
            static_cast<double>(request_.memory_limit_bytes) &&
        (!best || choice.processor_s < best->processor_s))
      best = choice;
    if (is_met || pilot_s > patience_s) break;
  }
  return best;
}

bool Planner::choose_polynomials() {
  basis_why_ = why_no_polynomials();
  if (!basis_why_.empty() || !plan_.pilot) return false;
  const double constants =
      std::max(plan_.pilot->elements_for(request_.target_error), least_elements());
  const double constants_s = plan_.pilot->processor_s_for(constants);
  const bool fits = constants <= elements_that_fit();
  const std::string of_constants = "constants take " + count(constants) + " elements and " +
                                   seconds(constants_s) + (fits ? "" : ", and do not fit");
  basis_why_ = of_constants + ": there is little to gain";
  if (fits && constants_s < kNothingToGain_s) return false;
  const auto best = fly_polynomials(fits ? constants_s : std::numeric_limits<double>::infinity());
  if (!best) return false;
  const std::string name = kDegreeNames[best->degree];
  const std::string why =
      name + " polynomials on " + count(best->pilot_elements) + " elements bind means to " +
      percent(best->pilot_bound) + ", so " +
      count(std::max(best->elements, static_cast<double>(best->pilot_elements))) +
      " foretold and " + seconds(best->processor_s) + "; " + of_constants;
  basis_why_ = why;
  if (fits && best->processor_s >= constants_s) return false;
  plan_polynomials(*best, constants, name, why);
  return true;
}

void Planner::plan_polynomials(const PolynomialChoice& choice, double constants,
                               const std::string& name, const std::string& why) {
  plan_.degree = choice.degree;
  plan_.elements = static_cast<std::size_t>(choice.elements);
  plan_.processor_s = choice.processor_s;
  plan_.bytes = static_cast<std::size_t>(8.0 * choice.unknowns * choice.unknowns);
  Decision mesh{"mesh",
                (choice.degree > 1 ? "graded towards edges, " : "uniform, ") +
                    count(plan_.elements) + " elements",
                choice.degree > 1 ? "what a degree gains is lost at edges on even elements"
                                  : "a first degree gains nothing by grading"};
  mesh.error_kind = ErrorKind::bound;
  mesh.error = request_.target_error;
  mesh.error_of = error_name();
  add(std::move(mesh));
  Decision basis{"basis", name + " polynomials on each element", why};
  basis.left_out = "a field of constants: means of surfaces are all that is found";
  basis.work = "unknowns";
  basis.planned_work = choice.unknowns;
  basis.full_work = constants;
  basis.error_kind = ErrorKind::bound;
  basis.error = request_.target_error;
  basis.error_of = "mean irradiance of a surface, together with the mesh; it rests on no order";
  add(std::move(basis));
  add({"exchange", "full matrix of moments, " + mebibytes(static_cast<double>(plan_.bytes)),
       "polynomials know no other"});
}

// Measured orders: tests/verification/basis_convergence_test.cpp.
void Planner::decide_basis() {
  Decision d{"basis", "constants, and a continuous field of quadratics between them", basis_why_};
  d.left_out =
      "polynomials of degree 1 to 4 (solve --basis), radiosities of vertices (--reconstruction)";
  d.error_kind = is_rms() ? ErrorKind::estimate : ErrorKind::bound;
  d.error = plan_.pilot ? mesh_error_ : std::numeric_limits<double>::quiet_NaN();
  d.error_of = std::string(error_name()) + ", together with the mesh";
  add(std::move(d));
}

}  // namespace truebox

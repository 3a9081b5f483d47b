// SPDX-License-Identifier: BSD-3-Clause
#include "solve_basis.h"

#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "image/image_file.h"
#include "radiometry/input_error.h"
#include "scene/requirements.h"
#include "transport/polynomial_means.h"

namespace truebox::app {
namespace {

using Eigen::Index;

constexpr const char* kNames[] = {"constant", "linear", "quadratic", "cubic", "quartic"};
constexpr std::size_t kUnknowns = 2400;  // where --elements is not given
constexpr std::size_t kUnknownsBehind =
    400;  // where surfaces hide each other: hundreds of times the work a pair

struct OnBasis {
  Scene scene;
  TargetedMeans solved;
  std::string plan;
  double seconds = 0.0;
};

void refuse(bool is_used, const char* option, const std::string& basis) {
  if (is_used)
    throw InputError("--basis", 0, std::string("constant elements with ") + option, basis);
}

// With a target the first solve is small: its bound foretells the rest.
std::size_t first_elements(const PredictionArguments& a, const Scene& scene, int degree) {
  if (a.elements > 0) return a.elements;
  if (!a.target_error.empty()) return PolynomialOptions{}.elements;
  const std::size_t functions = static_cast<std::size_t>(degree + 1) * (degree + 1);
  return (requirements(scene).occlusion ? kUnknownsBehind : kUnknowns) / functions;
}

OnBasis solve(const PredictionArguments& a, int degree) {
  OnBasis result;
  result.scene = read_scene_of(a);
  const auto start = std::chrono::steady_clock::now();
  PolynomialOptions options;
  options.degree = degree;
  options.elements = first_elements(a, result.scene, degree);
  options.memory_limit_bytes = a.memory_MiB << 20;
  if (a.target_error.empty()) {
    result.solved.means = polynomial_means(result.scene, options);
    result.solved.is_reached = true;
  } else {
    const double target = *share_of(a.target_error);
    options.kernel_tolerance = kernel_tolerance_for(target);
    result.solved = polynomial_means_to_target(result.scene, options, target);
  }
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

std::string as_json(const OnBasis& r) {
  const PolynomialMeans& means = r.solved.means;
  nlohmann::json json = {{"scene", r.scene.path},
                         {"basis", kNames[means.degree]},
                         {"elements", means.elements},
                         {"unknowns", means.unknowns},
                         {"bands", r.scene.bands.size()},
                         {"seconds", r.seconds},
                         {"largest_relative_bound_of_a_surface", means.largest_relative_bound()},
                         {"target_missed", !r.solved.is_reached},
                         {"solver", {{"outcome", means.solve.brief()}}},
                         {"units", {{"radiosity", r.scene.exitance_unit()}}},
                         {"band_centres_nm", r.scene.bands.centres_nm()},
                         {"surfaces", nlohmann::json::array()}};
  for (const TargetStep& step : r.solved.steps)
    json["target_attempts"].push_back(
        {{"elements", step.elements}, {"relative_bound", step.relative_bound}});
  const auto row = [](const BandMatrix& m, Index s) {
    const Eigen::VectorXd v = m.row(s);
    return std::vector<double>(v.begin(), v.end());
  };
  for (std::size_t s = 0; s < r.scene.surfaces.size(); ++s) {
    if (r.scene.surfaces[s].is_opening) continue;
    const auto k = static_cast<Index>(s);
    json["surfaces"].push_back({{"name", r.scene.surfaces[s].name},
                                {"radiosity", row(means.radiosity, k)},
                                {"radiosity_error_bound", row(means.radiosity_bound, k)}});
    if ((means.irradiance.row(k).array() > 0.0).all()) {
      json["surfaces"].back()["irradiance"] = row(means.irradiance, k);
      json["surfaces"].back()["irradiance_error_bound"] = row(means.irradiance_bound, k);
    }
  }
  return json.dump(1) + "\n";
}

void print(const OnBasis& r) {
  const PolynomialMeans& means = r.solved.means;
  if (!r.plan.empty()) fmt::print("  as planned: {}\n", r.plan);
  fmt::print("{} elements, {} unknowns ({}), {} bands, {:.2f} s\n  radiosity: {}\n", means.elements,
             means.unknowns, kNames[means.degree], r.scene.bands.size(), r.seconds,
             means.solve.brief());
  for (const TargetStep& step : r.solved.steps)
    fmt::print("  {} elements: means of surfaces bound to {:.3g} %\n", step.elements,
               100.0 * step.relative_bound);
  if (!r.solved.is_reached)
    fmt::print("  the target error is not reached: more elements do not fit the memory limit\n");
  const auto k = static_cast<Index>(r.scene.bands.size() / 2);
  fmt::print("{:<20}{:>17}{:>12}   ({})\n", "mean radiosity of",
             name_of_band(r.scene, r.scene.bands.size() / 2), "bound", r.scene.exitance_unit());
  for (std::size_t s = 0; s < r.scene.surfaces.size(); ++s)
    if (!r.scene.surfaces[s].is_opening)
      fmt::print("{:<20}{:>17.9g}{:>12.1e}\n", r.scene.surfaces[s].name,
                 means.radiosity(static_cast<Index>(s), k),
                 means.radiosity_bound(static_cast<Index>(s), k));
}

}  // namespace

std::vector<std::string> basis_names() { return {std::begin(kNames), std::end(kNames)}; }

int solve_on_basis(const PredictionArguments& a, const std::string& output) {
  refuse(!a.adaptive.empty(), "--adaptive", a.basis);
  refuse(a.sensitivities, "--sensitivities", a.basis);
  refuse(static_cast<bool>(a.solve_grid), "--distributed", a.basis);
  if (!output.empty() && !output.ends_with(".json"))
    throw InputError(output, 0, "an output ending in .json with --basis " + a.basis, output);
  std::unique_ptr<tbb::global_control> limit;
  if (a.threads > 0)
    limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                  static_cast<std::size_t>(a.threads));
  const auto at = std::find(std::begin(kNames), std::end(kNames), a.basis);
  OnBasis result = solve(a, static_cast<int>(at - std::begin(kNames)));
  result.plan = a.as_planned;
  print(result);
  if (result.solved.means.solve.outcome != SolveOutcome::converged) return kNotSolved;
  if (!output.empty()) write_file_atomically(output, as_json(result));
  return result.solved.is_reached ? kAgrees : kNotSolved;
}

}  // namespace truebox::app

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
#include "mesh/graded_mesh.h"
#include "radiometry/input_error.h"
#include "scene/requirements.h"
#include "transport/galerkin.h"

namespace truebox::app {
namespace {

using Eigen::Index;

constexpr const char* kNames[] = {"constant", "linear", "quadratic", "cubic", "quartic"};
constexpr double kGrading = 3.0;         // t^3 towards edges; pays from degree 2 on
constexpr double kTolerance = 1e-8;      // of the kernel's moments
constexpr std::size_t kUnknowns = 2400;  // where --elements is not given
constexpr std::size_t kUnknownsBehind =
    400;  // where surfaces hide each other: hundreds of times the work a pair

struct OnBasis {
  Scene scene;
  int degree = 0;
  std::size_t elements = 0;
  Index unknowns = 0;
  SolveSummary solve;
  BandMatrix mean, bound;  // surfaces x bands
  double seconds = 0.0;
};

void refuse(bool is_used, const char* option, const std::string& basis) {
  if (is_used)
    throw InputError("--basis", 0, std::string("constant elements with ") + option, basis);
}

BandMatrix of_surfaces(const Scene& scene, bool exitance) {
  BandMatrix values(static_cast<Index>(scene.surfaces.size()),
                    static_cast<Index>(scene.bands.size()));
  for (Index s = 0; s < values.rows(); ++s) {
    const Material& m = scene.material_of(scene.surfaces[static_cast<std::size_t>(s)]);
    for (Index k = 0; k < values.cols(); ++k)
      values(s, k) = exitance ? m.exitance[static_cast<std::size_t>(k)]
                              : m.reflectance[static_cast<std::size_t>(k)];
  }
  return values;
}

OnBasis solve(const PredictionArguments& a, int degree) {
  OnBasis result;
  result.scene = read_scene_of(a);
  result.degree = degree;
  const Scene& scene = result.scene;
  require_lambertian(scene);
  const auto start = std::chrono::steady_clock::now();
  const std::size_t functions = static_cast<std::size_t>(degree + 1) * (degree + 1);
  const std::size_t unknowns = requirements(scene).occlusion ? kUnknownsBehind : kUnknowns;
  const std::size_t elements = a.elements > 0 ? a.elements : unknowns / functions;
  const double edge_m = edge_for_count(scene, elements);
  const PatchMesh mesh =
      degree > 1 ? graded_mesh(scene, edge_m, kGrading) : uniform_mesh(scene, edge_m);
  GalerkinOptions options;
  options.degree = degree;
  options.relative_tolerance = kTolerance;
  options.memory_limit_bytes = a.memory_MiB << 20;
  const GalerkinSystem system(mesh, scene, options);
  const BandMatrix rho = of_surfaces(scene, false), exitance = of_surfaces(scene, true);
  BandMatrix coefficients;
  result.solve = system.solve(rho, system.project_constants(exitance), coefficients);
  result.elements = mesh.size();
  result.unknowns = system.unknowns();
  result.mean = system.surface_means(coefficients);
  result.bound = system.mean_error_bound(rho, exitance, coefficients);
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

std::string as_json(const OnBasis& r) {
  nlohmann::json json = {{"scene", r.scene.path},
                         {"basis", kNames[r.degree]},
                         {"elements", r.elements},
                         {"unknowns", r.unknowns},
                         {"bands", r.scene.bands.size()},
                         {"seconds", r.seconds},
                         {"solver", {{"outcome", r.solve.brief()}}},
                         {"units", {{"radiosity", r.scene.exitance_unit()}}},
                         {"band_centres_nm", r.scene.bands.centres_nm()},
                         {"surfaces", nlohmann::json::array()}};
  const auto row = [](const BandMatrix& m, Index s) {
    const Eigen::VectorXd v = m.row(s);
    return std::vector<double>(v.begin(), v.end());
  };
  for (std::size_t s = 0; s < r.scene.surfaces.size(); ++s)
    if (!r.scene.surfaces[s].is_opening)
      json["surfaces"].push_back({{"name", r.scene.surfaces[s].name},
                                  {"radiosity", row(r.mean, static_cast<Index>(s))},
                                  {"radiosity_error_bound", row(r.bound, static_cast<Index>(s))}});
  return json.dump(1) + "\n";
}

void print(const OnBasis& r) {
  fmt::print("{} elements, {} unknowns ({}), {} bands, {:.2f} s\n  radiosity: {}\n", r.elements,
             r.unknowns, kNames[r.degree], r.scene.bands.size(), r.seconds, r.solve.brief());
  const auto k = static_cast<Index>(r.scene.bands.size() / 2);
  fmt::print("{:<20}{:>17}{:>12}   ({})\n", "mean radiosity of",
             name_of_band(r.scene, r.scene.bands.size() / 2), "bound", r.scene.exitance_unit());
  for (std::size_t s = 0; s < r.scene.surfaces.size(); ++s)
    if (!r.scene.surfaces[s].is_opening)
      fmt::print("{:<20}{:>17.9g}{:>12.1e}\n", r.scene.surfaces[s].name,
                 r.mean(static_cast<Index>(s), k), r.bound(static_cast<Index>(s), k));
}

}  // namespace

std::vector<std::string> basis_names() { return {std::begin(kNames), std::end(kNames)}; }

int solve_on_basis(const PredictionArguments& a, const std::string& basis,
                   const std::string& output) {
  refuse(!a.adaptive.empty(), "--adaptive", basis);
  refuse(!a.target_error.empty(), "--target-error", basis);
  refuse(a.sensitivities, "--sensitivities", basis);
  refuse(static_cast<bool>(a.solve_grid), "--distributed", basis);
  if (!output.empty() && !output.ends_with(".json"))
    throw InputError(output, 0, "an output ending in .json with --basis " + basis, output);
  std::unique_ptr<tbb::global_control> limit;
  if (a.threads > 0)
    limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                  static_cast<std::size_t>(a.threads));
  const auto at = std::find(std::begin(kNames), std::end(kNames), basis);
  const OnBasis result = solve(a, static_cast<int>(at - std::begin(kNames)));
  print(result);
  if (result.solve.outcome != SolveOutcome::converged) return kNotSolved;
  if (!output.empty()) write_file_atomically(output, as_json(result));
  return kAgrees;
}

}  // namespace truebox::app

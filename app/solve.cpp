// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "export/solution_files.h"
#include "image/image_file.h"
#include "job_array.h"
#include "plan_settings.h"
#include "prediction_options.h"
#include "radiometry/input_error.h"
#include "ranks.h"
#include "scene/scene_file.h"
#include "snapshots.h"
#include "solve_basis.h"
#include "transport/net_flux.h"
#include "walkthrough/walkthrough.h"

namespace truebox::app {
namespace {

struct SolveArguments {
  PredictionArguments prediction;
  std::string output, summary;
  bool distributed = false;
  std::string petsc_options;
  std::string snapshots, camera;
  ArrayArguments array;
};

Observer observer() {
  return read_observer(
      std::filesystem::path(reference_directory()) / "colour" / "cie1931_2deg_xyz.csv",
      "CIE 1931 2 deg");
}

const char* name_of(ClosureRepair repair) {
  if (repair == ClosureRepair::none) return "none";
  return repair == ClosureRepair::scaling ? "scaling" : "least-squares";
}

std::vector<double> values(const Eigen::VectorXd& v) { return {v.data(), v.data() + v.size()}; }

// One entry a grid, the finest first: what a fit of cost against size needs.
nlohmann::json links_json(const Prediction& prediction) {
  nlohmann::json json = nlohmann::json::array();
  for (const GridSolution* grid :
       {&prediction.fine(), &prediction.coarse(), &prediction.coarsest()})
    if (grid->links)
      json.push_back({{"elements", grid->links->elements},
                      {"links", grid->links->links},
                      {"pairs_tried", grid->links->tried},
                      {"bytes", grid->links->bytes},
                      {"processor_s", grid->links->processor_s},
                      {"relative_tolerance", grid->links->relative_tolerance},
                      {"relative_error_estimate", grid->links->relative_error}});
  return json;
}

nlohmann::json summary_json(const Predicted& p) {
  const GridSolution& grid = p.prediction->fine();
  const FormFactorSummary& f = grid.form_factors;
  nlohmann::json attempts = nlohmann::json::array();
  for (const TargetStep& step : p.target.steps)
    attempts.push_back({{"elements", step.elements},
                        {"relative_bound", step.relative_bound},
                        {"where", step.where}});
  nlohmann::json shares;
  if (const auto& found = p.prediction->error_shares())
    shares = {{"discretisation", found->discretisation},
              {"form_factors", found->form_factors},
              {"solver", found->solver}};
  return {{"scene", p.scene.path},
          {"elements", grid.mesh.size()},
          {"elements_coarse", p.prediction->coarse().mesh.size()},
          {"bands", p.scene.bands.size()},
          {"bands_solved", p.prediction->needs().distinct_bands.size()},
          {"seconds", p.seconds},
          {"plan", p.prediction->needs().reasons},
          {"largest_relative_bound_of_a_surface", largest_relative_bound(*p.prediction)},
          {"error_shares", shares},
          {"target_attempts", attempts},
          {"target_missed", p.misses_target},
          {"form_factors",
           {{"pairs_unoccluded", f.pairs_unoccluded},
            {"pairs_hidden", f.pairs_hidden},
            {"pairs_sampled", f.pairs_sampled},
            {"rays", f.rays},
            {"closed", f.closed},
            {"closure_error_max", f.closure_error_max},
            {"closure_error_mean", f.closure_error_mean},
            {"repair", name_of(f.repair)},
            {"repair_max", f.repair_max},
            {"repair_rms", f.repair_rms},
            {"closure_residual_max", f.closure_residual_max}}},
          {"links", links_json(*p.prediction)},
          {"solver",
           {{"outcome", grid.solve.brief()},
            {"iterations", grid.solve.iterations},
            {"matrix_passes", grid.solve.matrix_passes},
            {"bands_reduced", grid.solve.bands_reduced},
            {"residual_history", grid.solve.residual_history}}}};
}

nlohmann::json solution_json(const Predicted& p) {
  nlohmann::json json = summary_json(p);
  json["units"] = {{"radiosity", p.scene.exitance_unit()},
                   {"irradiance", p.scene.exitance_unit()},
                   {"net_flux", p.scene.is_total ? "W" : "W nm^-1"},
                   {"area", "m^2"}};
  json["band_centres_nm"] = p.scene.bands.centres_nm();
  json["surfaces"] = nlohmann::json::array();
  for (const SurfaceMean& mean : surface_means(*p.prediction))
    json["surfaces"].push_back({{"name", mean.surface},
                                {"area", mean.area_m2},
                                {"radiosity", values(mean.radiosity)},
                                {"radiosity_error_bound", values(mean.radiosity_bound)},
                                {"irradiance", values(mean.irradiance)},
                                {"irradiance_error_bound", values(mean.irradiance_bound)}});
  for (const SurfaceFlux& flux : net_fluxes(*p.prediction))
    for (auto& surface : json["surfaces"])
      if (surface["name"] == flux.surface) {
        surface["net_flux"] = values(flux.net_W);
        surface["net_flux_error_bound"] = values(flux.bound_W);
      }
  const auto derivatives = p.prediction->radiosity_by_reflectance();
  for (std::size_t m = 0; m < derivatives.size(); ++m)
    for (auto& surface : json["surfaces"])
      for (std::size_t s = 0; s < p.scene.surfaces.size(); ++s)
        if (surface["name"] == p.scene.surfaces[s].name)
          surface["radiosity_by_reflectance"][p.scene.materials[m].name] =
              values(derivatives[m].row(static_cast<Eigen::Index>(s)).transpose());
  return json;
}

constexpr std::size_t kSurfacesShown = 100;

void print_surfaces(const Predicted& p) {
  const std::size_t bands = p.scene.bands.size();
  const std::vector<std::size_t> shown =
      bands < 3 ? std::vector<std::size_t>{0}
                : std::vector<std::size_t>{bands / 4, bands / 2, 3 * bands / 4};
  fmt::print("{:<20}", "mean radiosity of");
  for (std::size_t b : shown) fmt::print("{:>17}{:>10}", name_of_band(p.scene, b), "bound");
  fmt::print("   ({})\n", p.scene.exitance_unit());
  std::size_t printed = 0;
  for (const SurfaceMean& mean : surface_means(*p.prediction)) {
    if (++printed > kSurfacesShown) {
      fmt::print("... {} surfaces in all; -o FILE.json has the others\n", p.scene.surfaces.size());
      break;
    }
    fmt::print("{:<20}", mean.surface);
    for (std::size_t b : shown) {
      const auto k = static_cast<Eigen::Index>(b);
      const double share =
          mean.radiosity[k] > 0 ? mean.radiosity_bound[k] / mean.radiosity[k] : 0.0;
      fmt::print("{:>17.6g}{:>8.2f} %", mean.radiosity[k], 100.0 * share);
    }
    fmt::print("\n");
  }
}

// Heat that a surface gives or takes, over all bands.
void print_heat(const Predicted& p) {
  fmt::print("{:<20}{:>17}{:>14}   (W)\n", "net heat from", "flux", "bound");
  for (const SurfaceFlux& flux : net_fluxes(*p.prediction)) {
    double net_W = 0.0, bound_W = 0.0;
    for (std::size_t b = 0; b < p.scene.bands.size(); ++b) {
      const double width = p.scene.is_total ? 1.0 : p.scene.bands.width_nm(b);
      net_W += width * flux.net_W[static_cast<Eigen::Index>(b)];
      bound_W += width * flux.bound_W[static_cast<Eigen::Index>(b)];
    }
    fmt::print("{:<20}{:>17.6g}{:>14.2g}\n", flux.surface, net_W, bound_W);
  }
}

// What -o can be, by its ending.
const std::map<std::string, std::string (*)(const Predicted&)>& writers() {
  static const std::map<std::string, std::string (*)(const Predicted&)> kWriters = {
      {".json", [](const Predicted& p) { return solution_json(p).dump(1) + "\n"; }},
      {".vtu", [](const Predicted& p) { return solution_vtu(*p.prediction); }},
      {".glb", [](const Predicted& p) { return solution_glb(*p.prediction, observer()); }},
      {".html", [](const Predicted& p) {
         return walkthrough_html(*p.prediction, observer(),
                                 std::filesystem::path(p.scene.path).filename().string());
       }}};
  return kWriters;
}

int solve_here(const SolveArguments& a, Ranks* ranks) {
  const auto writer = writers().find(std::filesystem::path(a.output).extension().string());
  if (!a.output.empty() && writer == writers().end())
    throw InputError(a.output, 0, "an output ending in .json, .vtu, .glb or .html",
                     std::filesystem::path(a.output).extension().string());
  PredictionArguments asked = a.prediction;
  asked.interpolated = !a.output.empty() && !a.output.ends_with(".json");
  const auto predicted = predict(asked);
  if (ranks && !ranks->is_first()) return kAgrees;  // the first rank says and writes all
  fmt::print("{}", describe(*predicted));
  if (ranks) fmt::print("{}", ranks->describe());
  if (predicted->prediction->outcome() != SolveOutcome::converged) {
    fmt::print(stderr, "truebox: the solver did not reach its bound: {}\n",
               predicted->prediction->fine().solve.brief());
    return kNotSolved;
  }
  print_surfaces(*predicted);
  if (predicted->scene.is_thermal) print_heat(*predicted);
  if (!a.output.empty()) write_file_atomically(a.output, writer->second(*predicted));
  if (!a.summary.empty()) write_file_atomically(a.summary, summary_json(*predicted).dump(1) + "\n");
  return predicted->misses_target ? kNotSolved : kAgrees;
}

// Nothing but means of surfaces is asked for, so that any basis would do.
bool wants_means_only(const SolveArguments& a) {
  return (a.output.empty() || a.output.ends_with(".json")) && a.summary.empty() &&
         a.snapshots.empty() && !a.distributed && !a.prediction.sensitivities &&
         a.prediction.reconstruction.empty();
}

int solve(const SolveArguments& a) {
  if (!a.prediction.automatic.empty() && wants_means_only(a)) {
    SolveArguments as_planned = a;
    as_planned.prediction.means_only = true;
    std::string line;
    as_planned.prediction = planned(read_scene_of(a.prediction), as_planned.prediction, line);
    as_planned.prediction.as_planned = line;
    return solve(as_planned);
  }
  if (a.prediction.basis != "constant") {
    if (!a.snapshots.empty() || a.distributed || !a.summary.empty())
      throw InputError("--basis", 0, "constant elements for snapshots, ranks and summaries",
                       a.prediction.basis);
    return solve_on_basis(a.prediction, a.output);
  }
  if (!a.snapshots.empty()) {
    if (a.distributed) throw InputError("--snapshots", 0, "one process", "--distributed");
    const Scene scene = read_scene_of(a.prediction);
    SolveArguments watched = a;
    watched.snapshots.clear();
    watched.prediction.watch_finest = snapshots(scene, {a.snapshots, a.camera, 384, observer()});
    const int code = solve(watched);
    fmt::print("Pictures of the way there: {}\n", a.snapshots);
    return code;
  }
  if (!a.distributed) return solve_here(a, nullptr);
  Ranks ranks(a.petsc_options);
  return ranks.guarded([&] {
    SolveArguments of_rank = a;
    ranks.prepare(of_rank.prediction);
    return solve_here(of_rank, &ranks);
  });
}

}  // namespace

void add_solve_command(CLI::App& program, Action& chosen) {
  auto* command = program.add_subcommand("solve", "radiosity in every band, with an error bound");
  auto arguments = std::make_shared<SolveArguments>();
  add_prediction_options(*command, arguments->prediction);
  add_array_options(*command, arguments->array);
  arguments->prediction.error_shares = true;
  command->add_flag("--sensitivities", arguments->prediction.sensitivities,
                    "derivatives of every surface's radiosity by every material's reflectance, "
                    "into the .json");
  command->add_option("-o,--output", arguments->output,
                      "means of the surfaces (.json) or all elements (.vtu for ParaView, .glb, "
                      ".html to walk through)");
  command->add_option("--summary", arguments->summary, "how the solve went, as JSON");
  command->add_option("--snapshots", arguments->snapshots,
                      "folder for pictures of the solution on its way (with --method southwell or "
                      "southwell-ambient: usable long before the end)");
  command->add_option("--camera", arguments->camera, "the camera of these pictures");
  command->add_flag("--distributed", arguments->distributed,
                    "one of the ranks that mpirun started: rows of form factors (exact-visibility) "
                    "are shared out");
  command->add_option("--petsc-options", arguments->petsc_options,
                      "PETSc's own, for --distributed: \"-ksp_type gmres -ksp_monitor\"");
  command->footer(
      "Example: truebox solve reference/cornell_box/cornell_box.toml -o box.vtu\n"
      "         mpirun -n 4 truebox solve scene.toml --distributed -o scene.json\n"
      "         truebox solve a.toml b.toml --vary elements=500,1000 --index 0 --parts 4 -o runs\n"
      "Several jobs (more scenes, --vary, --index) leave one .json each in the folder of -o, and "
      "a\n"
      "table; truebox merge puts the parts of an array together.");
  command
      ->add_option("--basis", arguments->prediction.basis,
                   "radiosity on an element: constant, or polynomials (Galerkin): means of the "
                   "surfaces, to many digits where nothing stands between two of them; --elements "
                   "is some hundreds then, or as --target-error asks")
      ->capture_default_str()
      ->excludes(command->get_option("--auto"))
      ->check(CLI::IsMember(basis_names()));
  command->callback([=, &chosen] {
    if (arguments->prediction.basis != "constant" && command->count("--elements") == 0)
      arguments->prediction.elements = 0;  // as the degree has it
    chosen = [=] {
      return arguments->array.is_many()
                 ? run_array(*command, arguments->array, arguments->prediction.scene,
                             arguments->output, ".json")
                 : solve(*arguments);
    };
  });
}

}  // namespace truebox::app

// SPDX-License-Identifier: BSD-3-Clause
#include "planning/plan.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "image/image_file.h"
#include "plan_colour.h"
#include "plan_settings.h"
#include "planning/full_model.h"
#include "radiometry/input_error.h"
#include "scene/scene_file.h"
#include "solve_basis.h"

namespace truebox::app {
namespace {

struct PlanArguments {
  PredictionArguments wished;
  std::string json, camera, surface;
  bool rms = false;
  double target_colour = 0.0;
  bool verify = false;
  std::size_t verify_elements = 600;
};

constexpr double kNoSaving = 1.001;
constexpr std::size_t kSurfacesShown = 24;

const char* text_of(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::none: return "none";
    case ErrorKind::bound: return "at most";
    case ErrorKind::estimate: return "about";
    case ErrorKind::noise: return "noise of";
  }
  return "";
}

std::string error_text(const Decision& d) {
  if (d.error_kind == ErrorKind::none) return "none, exact";
  if (!std::isfinite(d.error)) return "not foretold: the solve states it";
  return fmt::format("{} {:.2g} % ({})", text_of(d.error_kind), 100.0 * d.error, d.error_of);
}

std::string work_text(const Decision& d) {
  if (d.work.empty() || d.saving() <= kNoSaving) return {};
  const double saving = d.saving();
  return fmt::format("{:.3g} {} instead of {:.3g}: {}", d.planned_work, d.work, d.full_work,
                     std::isinf(saving) ? "none left" : fmt::format("{:.3g} times less", saving));
}

std::string decisions_text(const Plan& plan) {
  std::string text;
  for (const Decision& d : plan.decisions) {
    text += fmt::format("{:<16}{}\n{:18}because {}\n", d.topic, d.choice, "", d.why);
    if (!d.left_out.empty()) text += fmt::format("{:18}left out: {}\n", "", d.left_out);
    if (const std::string work = work_text(d); !work.empty())
      text += fmt::format("{:18}work: {}\n", "", work);
    text += fmt::format("{:18}error this can cause: {}\n", "", error_text(d));
  }
  return text;
}

// One character a pair: '#' in full, '+' perhaps partly, '.' nothing.
std::string matrix_text(const Scene& scene, const Plan& plan) {
  if (!plan.visibility || scene.surfaces.size() > kSurfacesShown) return {};
  std::string text = "which surfaces see which: # nothing between, + perhaps partly, . nothing\n";
  const std::size_t n = scene.surfaces.size();
  for (std::size_t i = 0; i < n; ++i) {
    text += fmt::format("  {:<24.24}", scene.surfaces[i].name);
    for (std::size_t j = 0; j < n; ++j) {
      const Sight sight = plan.visibility->between(i, j);
      text += sight == Sight::full ? '#' : sight == Sight::partial ? '+' : '.';
    }
    text += '\n';
  }
  return text;
}

std::string colour_text(const std::vector<BandChoice>& choices, const BandChoice& chosen,
                        double target) {
  std::string text = fmt::format(
      "colours          within dE00 {:g} with {} bands weighted by the lamps\n", target,
      chosen.bands > 0 ? std::to_string(chosen.bands) : "no fewer than the scene's own");
  for (const BandChoice& c : choices)
    if (c.bands > 0)
      text += fmt::format(
          "{:18}{:>4} bands: dE00 at most {:.3g}, mean {:.3g}; {:.2f} of the time\n", "", c.bands,
          c.largest_dE00, c.mean_dE00, c.processor_s / choices.back().processor_s);
  return text;
}

std::string claims_text(const std::vector<ClaimCheck>& claims) {
  if (claims.empty()) return "held to the full model: nothing is left out of it\n";
  std::string text =
      fmt::format("held to the full model\n  {:<28}{:>11}{:>11}  {:<14}{:>12}{:>12}{:>12}\n",
                  "claim", "planned", "full", "work", "time x", "difference", "allowed");
  for (const ClaimCheck& c : claims)
    text += fmt::format("  {:<28}{:>11.4g}{:>11.4g}  {:<14}{:>12.3g}{:>12.2e}{:>12.2e}  {}\n",
                        c.claim, c.planned_work, c.full_work, c.work,
                        c.planned_s > 0.0 ? c.full_s / c.planned_s : 0.0, c.difference, c.allowed,
                        c.holds() ? "holds" : "DOES NOT HOLD");
  return text;
}

nlohmann::json decision_json(const Decision& d) {
  nlohmann::json json = {{"topic", d.topic},
                         {"choice", d.choice},
                         {"because", d.why},
                         {"left_out", d.left_out},
                         {"error_kind", text_of(d.error_kind)},
                         {"error", d.error},
                         {"error_of", d.error_of}};
  if (!d.work.empty())
    json["work"] = {{"unit", d.work}, {"planned", d.planned_work}, {"full_model", d.full_work}};
  return json;
}

nlohmann::json sight_json(const Scene& scene, const Plan& plan) {
  nlohmann::json rows = nlohmann::json::array();
  if (!plan.visibility) return rows;
  for (std::size_t i = 0; i < scene.surfaces.size(); ++i) {
    nlohmann::json sees = nlohmann::json::object();
    for (std::size_t j = 0; j < scene.surfaces.size(); ++j)
      if (const Sight sight = plan.visibility->between(i, j); sight != Sight::none)
        sees[scene.surfaces[j].name] = sight == Sight::full ? "full" : "partial";
    rows.push_back({{"surface", scene.surfaces[i].name}, {"sees", sees}});
  }
  return rows;
}

nlohmann::json plan_json(const Scene& scene, const Plan& plan, const std::string& command) {
  nlohmann::json decisions = nlohmann::json::array();
  for (const Decision& d : plan.decisions) decisions.push_back(decision_json(d));
  const char* const methods[] = {"direct light", "radiosity", "path tracing"};
  const char* const exchanges[] = {"none", "full matrix", "streamed", "hierarchical"};
  nlohmann::json json = {{"scene", scene.path},
                         {"surfaces", scene.surfaces.size()},
                         {"bands", scene.bands.size()},
                         {"bands_distinct", plan.needs.distinct_bands.size()},
                         {"bands_solved", plan.bands_solved},
                         {"occlusion", plan.needs.occlusion},
                         {"interreflection", plan.needs.interreflection},
                         {"path_tracing", plan.needs.path_tracing},
                         {"method", methods[static_cast<int>(plan.method)]},
                         {"exchange", exchanges[static_cast<int>(plan.exchange)]},
                         {"basis", basis_names()[static_cast<std::size_t>(plan.degree)]},
                         {"elements", plan.elements},
                         {"adapted", plan.mesh == PlannedMesh::adapted},
                         {"discontinuities", plan.discontinuities},
                         {"paths_a_pixel", plan.paths},
                         {"estimated_processor_s", plan.processor_s},
                         {"estimated_bytes", plan.bytes},
                         {"command", command},
                         {"decisions", decisions},
                         {"visibility", sight_json(scene, plan)},
                         {"reasons", plan.needs.reasons}};
  if (plan.pilot)
    json["pilot"] = {{"elements", plan.pilot->elements},
                     {"relative_bound", plan.pilot->relative_bound},
                     {"processor_s", plan.pilot->processor_s},
                     {"cost_exponent", plan.pilot->cost_exponent},
                     {"indirect_share", plan.pilot->indirect_share}};
  return json;
}

nlohmann::json claims_json(const std::vector<ClaimCheck>& claims) {
  nlohmann::json json = nlohmann::json::array();
  for (const ClaimCheck& c : claims)
    json.push_back({{"claim", c.claim},
                    {"work", c.work},
                    {"planned", c.planned_work},
                    {"full", c.full_work},
                    {"planned_processor_s", c.planned_s},
                    {"full_processor_s", c.full_s},
                    {"difference", c.difference},
                    {"allowed", c.allowed},
                    {"allowed_because", c.allowed_why},
                    {"holds", c.holds()}});
  return json;
}

std::string expected_text(const Plan& plan) {
  std::string text;
  if (plan.processor_s > 0.0)
    text = fmt::format("{:.2g} s of processor time (within a factor of three)", plan.processor_s);
  if (plan.bytes > 0)
    text += fmt::format("{}{:.2g} MiB of {}", text.empty() ? "" : ", ",
                        static_cast<double>(plan.bytes) / (1 << 20),
                        plan.exchange == PlannedExchange::hierarchical ? "links and elements"
                        : plan.exchange == PlannedExchange::streamed   ? "radiosity"
                                                                       : "form factors");
  return text.empty() ? text : "expected          " + text + "\n";
}

PredictionArguments wished_of(const PlanArguments& a) {
  PredictionArguments wished = a.wished;
  if (!a.camera.empty()) wished.automatic = "camera:" + a.camera;
  if (!a.surface.empty()) wished.automatic = "surface:" + a.surface;
  if (a.rms) wished.automatic = "irradiance";
  wished.means_only = !a.rms && a.camera.empty() && !wished.interpolated;
  return wished;
}

int plan(const PlanArguments& a) {
  const Scene scene = read_scene(a.wished.scene);
  const PredictionArguments wished = wished_of(a);
  const Plan plan = plan_for(scene, wished);
  PredictionArguments settings = applied(plan, wished);
  fmt::print("{}: {} surfaces, {} materials, {} bands\n{}{}", scene.path, scene.surfaces.size(),
             scene.materials.size(), scene.bands.size(), decisions_text(plan),
             matrix_text(scene, plan));
  std::vector<BandChoice> choices;
  if (a.target_colour > 0.0) {
    require_lambertian(scene);
    choices = band_choices(scene, wished);
    if (choices.empty())
      throw InputError(scene.path, 0, "a lamp with a spectrum, because colours are asked for",
                       "none");
    BandChoice chosen = choices.back();
    for (auto c = choices.rbegin(); c != choices.rend() && c->largest_dE00 <= a.target_colour; ++c)
      chosen = *c;
    settings.bands = chosen.bands;
    fmt::print("{}", colour_text(choices, chosen, a.target_colour));
  }
  const std::string command = command_line(plan, settings);
  fmt::print("{}command           {}\n", expected_text(plan), command);
  std::vector<ClaimCheck> claims;
  if (a.verify) {
    claims = check_claims(scene, plan, a.verify_elements);
    fmt::print("{}", claims_text(claims));
  }
  if (!a.json.empty()) {
    nlohmann::json json = plan_json(scene, plan, command);
    if (a.verify) json["claims"] = claims_json(claims);
    for (const BandChoice& c : choices)
      json["colour"].push_back({{"bands", c.bands > 0 ? c.bands : scene.bands.size()},
                                {"largest_dE00", c.largest_dE00},
                                {"mean_dE00", c.mean_dE00},
                                {"processor_s", c.processor_s}});
    write_file_atomically(a.json, json.dump(2) + "\n");
  }
  const bool all_hold =
      std::all_of(claims.begin(), claims.end(), [](const ClaimCheck& c) { return c.holds(); });
  return all_hold ? kAgrees : kFailsGate;
}

}  // namespace

void add_plan_command(CLI::App& program, Action& chosen) {
  auto* command = program.add_subcommand(
      "plan", "what a scene requires for an error, what is left out, and what that saves");
  auto a = std::make_shared<PlanArguments>();
  command->add_option("SCENE", a->wished.scene, "scene file (TOML)")->required();
  command
      ->add_option("--target-error", a->wished.target_error,
                   "share that each surface's mean is to be bound to, or the noise of a pixel "
                   "where paths are traced (1%)")
      ->check(check_share);
  command
      ->add_option("--target-colour", a->target_colour,
                   "dE00 that fewer bands may change a colour by: how many bands that takes")
      ->check(CLI::Range(0.01, 100.0));
  auto* camera = command->add_option("--camera", a->camera, "what counts is what this camera sees");
  auto* surface =
      command->add_option("--surface", a->surface, "what counts is the mean of this surface")
          ->excludes(camera);
  command
      ->add_flag("--rms", a->rms,
                 "what counts is the rms error of irradiance over all surfaces, relative to its "
                 "mean: foretold, not bound; solve --auto=irradiance does the same")
      ->excludes(camera)
      ->excludes(surface);
  command->add_flag("--interpolated", a->wished.interpolated,
                    "values are interpolated between corners, as viewers of .vtu and .glb do: "
                    "whether elements should follow lines of light");
  command->add_option("--memory", a->wished.memory_MiB, "MiB that form factors or links may take")
      ->capture_default_str()
      ->check(CLI::Range(16, 1 << 24));
  command->add_flag("--verify", a->verify,
                    "hold each claim to the model that does not make it, on a small mesh; exit "
                    "code 2 if one does not hold");
  command->add_option("--verify-elements", a->verify_elements, "of that mesh, about")
      ->capture_default_str()
      ->check(CLI::Range(4, 10000));
  command->add_option("--json", a->json, "also write the plan as JSON");
  command->add_flag("--quiet", a->wished.quiet, "no progress");
  command->footer(
      "`truebox solve SCENE --auto` does what the plan says.\n"
      "Example: truebox plan reference/cornell_box/cornell_box.toml --target-error 2% "
      "--target-colour 1");
  command->callback([=, &chosen] { chosen = [=] { return plan(*a); }; });
}

}  // namespace truebox::app

// SPDX-License-Identifier: BSD-3-Clause
#include "sweep.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>

#include "commands.h"
#include "job_array.h"
#include "prediction_options.h"
#include "radiometry/input_error.h"
#include "scene/scene_file.h"
#include "text_file.h"
#include "version.h"
#include "view_factor_commands.h"

namespace truebox::app {
namespace {

struct Subject {
  const char* name;
  std::unique_ptr<SweepSubject> (*make)(const Scene& scene, const SweepArguments& arguments);
};
constexpr Subject kSubjects[] = {{"irradiance", sweep_irradiance},
                                 {"viewfactors", sweep_view_factors},
                                 {"radiosity", sweep_radiosity}};

// Everything that another answer would come from.
std::string settings_of(const SweepArguments& a) {
  return fmt::format(
      "from \"{}\" to \"{}\", {:g} s a point, points \"{}\", reference \"{}\", camera \"{}\", {} "
      "places, reference to {} in {:g} s, up to {} elements and {} paths",
      a.from, a.to, a.time_limit_s, a.points, a.reference, a.camera, a.places, a.reference_error,
      a.reference_time_s, a.largest_elements, a.largest_paths);
}

LedgerHeader header_of(const Scene& scene, const SweepArguments& a, const SweepSubject& subject) {
  LedgerHeader header;
  header.command = "sweep --of " + a.of;
  header.version = kVersion;
  header.inputs["scene"] = fingerprint(scene);
  header.inputs["settings"] = settings_of(a);
  for (const std::string& file : {a.points, a.reference})
    if (!file.empty()) header.inputs["file " + file] = fingerprint(read_text(file));
  header.jobs = subject.jobs();
  header.share = a.share;
  return header;
}

std::string state_of(const SweepArguments& a) {
  if (!a.state.empty() || a.output.empty()) return a.state;
  return state_file(a.output, a.share);
}

int sweep(SweepArguments a, std::size_t parts) {
  a.share = share_of_jobs(a.index, parts);
  if (a.share.parts > 1 && state_of(a).empty())
    throw InputError("--index", 0, "-o, a folder for the state of this part", "none");
  const Scene scene = read_scene(a.scene);
  const Subject* chosen = nullptr;
  for (const Subject& subject : kSubjects)
    if (a.of == subject.name) chosen = &subject;
  const auto subject = chosen->make(scene, a);
  const std::string state = state_of(a);
  if (a.restart && !state.empty()) std::filesystem::remove(state);
  if (!a.output.empty()) std::filesystem::create_directories(a.output);
  const LedgerHeader header = header_of(scene, a, *subject);
  RunLedger ledger(state, header);
  const auto to_do = ledger.missing();
  if (to_do.size() < header.jobs.size() && a.share.parts == 1 && !a.quiet)
    fmt::print(stderr, "continuing {}: {} of {} settings are done\n", state,
               header.jobs.size() - to_do.size(), header.jobs.size());
  if (!to_do.empty()) ledger.set_shared(shared_json(subject->prepare()));
  const auto progress = terminal_progress(a.quiet);
  for (std::size_t k = 0; k < to_do.size(); ++k) {
    if (progress)
      progress(header.jobs[to_do[k]], static_cast<double>(k) / static_cast<double>(to_do.size()));
    ledger.add(to_do[k], to_json(subject->run(to_do[k])));
  }
  if (progress) progress("", 1.0);
  if (a.share.parts > 1) {
    fmt::print("part {} of {} is done: {}\n", a.share.index, a.share.parts, state);
    return kAgrees;
  }
  return present(sweep_of(ledger), a,
                 {{"Program", fmt::format("truebox {}", kVersion)},
                  {"Scene", fmt::format("{}, {}", a.scene, header.inputs.at("scene"))},
                  {"Settings", header.inputs.at("settings")},
                  {"Time", "processor time of all threads"}});
}

}  // namespace

void add_sweep_command(CLI::App& program, Action& chosen) {
  auto* command = program.add_subcommand(
      "sweep", "speed against accuracy over methods and settings; the Pareto front");
  auto a = std::make_shared<SweepArguments>();
  auto parts = std::make_shared<std::size_t>(0);
  std::vector<std::string> subjects;
  for (const Subject& subject : kSubjects) subjects.emplace_back(subject.name);
  command->add_option("SCENE", a->scene, "scene file (TOML)")->required();
  command
      ->add_option("--of", a->of,
                   "what to compute: irradiance by all methods, view factors, or "
                   "the solution of the radiosity system")
      ->capture_default_str()
      ->check(CLI::IsMember(subjects));
  command->add_option("-o,--output", a->output,
                      "folder for report.html, sweep.json and the state of the run");
  command->add_option("--json", a->json, "every number as JSON");
  command->add_option("--plot", a->plot, "error against time as SVG");
  command->add_option("--state", a->state,
                      "where finished settings are kept: a run that was stopped goes on (run.json "
                      "in the folder of -o)");
  command->add_flag("--restart", a->restart, "do not continue an earlier run");
  auto* points = command->add_option(
      "--points", a->points, "of irradiance: CSV of places as for probe, instead of random");
  command->add_option("--camera", a->camera, "of irradiance: places that this camera sees")
      ->excludes(points);
  command->add_option("--places", a->places, "of irradiance: how many random places")
      ->capture_default_str()
      ->check(CLI::Range(1, 10000))
      ->excludes(points);
  auto* reference = command->add_option(
      "--reference", a->reference,
      "of irradiance: CSV with name,band_nm,irradiance,standard_error at --points; else paths are "
      "traced");
  command
      ->add_option("--reference-error", a->reference_error,
                   "standard error, rms, to trace that reference to")
      ->capture_default_str()
      ->check(check_share)
      ->excludes(reference);
  command
      ->add_option("--reference-time", a->reference_time_s,
                   "s of processor time that tracing it may take: what it reached by then is its "
                   "error")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 1e6))
      ->excludes(reference);
  command->add_option("--save-reference", a->save_reference, "write the reference as such a CSV");
  command->add_option("--largest-elements", a->largest_elements, "finest grid of irradiance")
      ->capture_default_str()
      ->check(CLI::Range(16, 200000));
  command->add_option("--largest-paths", a->largest_paths, "most paths a place of irradiance")
      ->capture_default_str()
      ->check(CLI::Range(16, 1 << 24));
  command->add_option("--from", a->from, "of viewfactors: only from this surface");
  command->add_option("--to", a->to, "of viewfactors: only to this surface");
  command
      ->add_option("--time-limit", a->time_limit_s,
                   "of viewfactors and radiosity: s of one point of the sweep")
      ->capture_default_str()
      ->check(CLI::Range(0.01, 3600.0));
  add_share_options(*command, a->index, *parts);
  command->add_flag("--quiet", a->quiet, "no progress");
  command->footer(
      "Example: truebox sweep reference/cornell_box/cornell_box.toml -o out/sweep\n"
      "           --points reference/independent_renders/probe_points.csv\n"
      "           --reference reference/independent_renders/probe_irradiance.csv\n"
      "         truebox sweep room.toml --index 0 --parts 4 -o out/sweep   (then truebox merge)");
  command->callback([=, &chosen] { chosen = [=] { return sweep(*a, *parts); }; });
}

}  // namespace truebox::app

// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/core.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "fit/chart_measurement.h"
#include "fit_scene.h"
#include "image/image_file.h"
#include "readings/scene_measurement.h"

namespace truebox::app {
namespace {

struct FitArguments {
  std::string measurement;
  std::string output;
  std::string directory;
  bool all_patches = false;
  bool select = false;
};

nlohmann::json estimate_json(const Estimate& e) {
  return {{"value", e.value}, {"u", e.standard_uncertainty}};
}

nlohmann::json budget_json(const UncertaintyBudget& budget) {
  nlohmann::json json = nlohmann::json::object();
  for (const auto& c : budget.contributions()) json[c.name] = c.standard_uncertainty;
  return json;
}

nlohmann::json missing_json(const MissingContribution& missing) {
  return {{"in_words", missing.in_words()},
          {"is_missing", missing.is_missing()},
          {"additive_u", missing.additive_u},
          {"relative_u", missing.relative_u},
          {"misses", missing.misses},
          {"misses_that_read_low", missing.low_misses},
          {"read_low", missing.low},
          {"offset", estimate_json(missing.offset)},
          {"slope", estimate_json(missing.slope)}};
}

nlohmann::json reading_json(const PatchReading& r) {
  nlohmann::json json{{"patch", r.patch},
                      {"use", to_string(r.standard ? Use::input : Use::held_out)},
                      {"at_bound", r.at_bound},
                      {"reference", estimate_json(r.reference)},
                      {"reference_budget", budget_json(r.reference_budget)}};
  json["measured"]["value"] = r.measured.value;
  if (r.at_bound) return json;  // no uncertainty is claimed at a bound
  json["measured"]["u"] = r.measured.standard_uncertainty;
  json["measured_budget"] = budget_json(r.measured_budget);
  json["en"] = r.en.value;
  return json;
}

nlohmann::json fit_json(const ChartFit& fit) {
  return {{"field_order", fit.field_order},
          {"outcome", to_string(fit.summary.outcome)},
          {"summary", fit.summary.brief()},
          {"null_direction", fit.summary.null_direction},
          {"chi2_per_dof", fit.summary.chi2_per_dof},
          {"chi2_standards", fit.summary.chi2_standards},
          {"condition", fit.summary.condition},
          {"gain_dn_per_s", fit.gain},
          {"illumination", fit.field}};
}

nlohmann::json band_json(const BandMeasurement& band) {
  nlohmann::json json{{"band", band.name},
                      {"outcome", to_string(band.outcome)},
                      {"site", std::string(1, band.site)},
                      {"note", band.note},
                      {"centre_nm", estimate_json(band.band.centre_nm)},
                      {"measured_centre_nm", band.band.measured_centre_nm},
                      {"stated_centre_nm", band.band.stated_centre_nm},
                      {"veil", estimate_json(band.veil)},
                      {"veil_kept", band.veil_kept},
                      {"rms", band.rms},
                      {"rms_if_centre_as_measured", band.rms_measured_centre},
                      {"largest_en", band.largest_en},
                      {"agreeing", band.agreeing},
                      {"held_out", band.held_out},
                      {"chi2_per_dof", band.chi2_per_dof}};
  for (const auto& fit : band.fits) json["fits"].push_back(fit_json(fit));
  for (const auto& r : band.readings) json["readings"].push_back(reading_json(r));
  for (const auto& s : band.sites)
    json["sites"].push_back({{"site", std::string(1, s.site)},
                             {"brightest_standard_dn", s.white_dn},
                             {"standards_rms", s.standards_rms},
                             {"held_out_rms", s.held_out_rms},
                             {"used", s.used}});
  return json;
}

void print_table(const ChartMeasurement& measurement, bool all_patches) {
  fmt::print("{}\nheld-out patches, photograph minus spectrometer; E_n with k = 2\n\n",
             measurement.file.title);
  fmt::print("{:<8} {:>4} {:>14} {:>8} {:>9} {:>8} {:>8}  {}\n", "band", "site", "centre / nm",
             "RMS", "max|E_n|", "agree", "chi2/nu", "fit");
  for (const auto& b : measurement.bands) {
    fmt::print(
        "{:<8} {:>4} {:>7.1f} +- {:<3.1f} {:>8.4f} {:>9.2f} {:>8} {:>8.2f}  {}{}\n", b.name, b.site,
        b.band.centre_nm.value, b.band.centre_nm.standard_uncertainty, b.rms, b.largest_en,
        fmt::format("{}/{}", b.agreeing, b.held_out), b.chi2_per_dof, to_string(b.outcome),
        b.veil_kept
            ? fmt::format(", veil {:.3f} +- {:.3f}", b.veil.value, b.veil.standard_uncertainty)
            : "");
    if (b.outcome != Outcome::converged)
      for (const auto& fit : b.fits) fmt::print("         {}\n", fit.summary.brief());
  }
  fmt::print("\npatches with |E_n| > 1{}\n", all_patches ? ", and all others" : "");
  for (const auto& b : measurement.bands)
    for (const auto& r : b.readings)
      if (all_patches || (!r.standard && !r.en.agrees()))
        fmt::print("{:<8} {:<14} {:.4f} +- {:.4f}   reference {:.4f} +- {:.4f}   E_n {:+.2f}{}\n",
                   b.name, r.patch, r.measured.value, r.measured.standard_uncertainty,
                   r.reference.value, r.reference.standard_uncertainty, r.en.value,
                   r.at_bound   ? "  at bound"
                   : r.standard ? "  standard"
                                : "");
  fmt::print("\nheld-out readings: {}\n", measurement.missing().in_words());
}

int fit(const FitArguments& arguments) {
  if (is_scene_measurement(arguments.measurement))
    return fit_scene_measurement(
        {arguments.measurement, arguments.output, arguments.directory, arguments.select});
  if (arguments.select || !arguments.directory.empty()) {
    fmt::print(stderr, "truebox: {} belongs to measurements of a scene\n",
               arguments.select ? "--select" : "--report");
    return kUsage;
  }
  const bool terminal = isatty(STDERR_FILENO) != 0;
  const ChartMeasurement measurement =
      measure_chart(read_measurement(arguments.measurement), [&](const std::string& stage, double) {
        if (terminal) std::fprintf(stderr, "\r\033[K%s", stage.c_str());
      });
  if (terminal) std::fprintf(stderr, "\r\033[K");
  print_table(measurement, arguments.all_patches);
  if (!arguments.output.empty()) {
    nlohmann::json json{{"title", measurement.file.title},
                        {"measurement", measurement.file.path},
                        {"source", measurement.file.provenance.source},
                        {"outcome", to_string(measurement.outcome())},
                        {"agreeing", measurement.agreeing()},
                        {"held_out", measurement.held_out()},
                        {"budget_lacks", missing_json(measurement.missing())}};
    for (const auto& band : measurement.bands) json["bands"].push_back(band_json(band));
    write_file_atomically(arguments.output, json.dump(2) + "\n");
  }
  return measurement.outcome() == Outcome::converged ? kAgrees : kNotSolved;
}

}  // namespace

void add_fit_command(CLI::App& program, Action& chosen) {
  auto* command =
      program.add_subcommand("fit", "reflectances from photographs, with their uncertainties");
  auto arguments = std::make_shared<FitArguments>();
  command->add_option("MEASUREMENT", arguments->measurement, "measurement file (TOML)")->required();
  command->add_option("-o,--output", arguments->output, "JSON file with every number");
  command->add_flag("--all", arguments->all_patches,
                    "chart: print every patch, not only those that differ");
  command->add_option("--report", arguments->directory,
                      "scene: folder of a report (HTML, JSON) and residual maps (EXR, PNG)");
  command->add_flag("--select", arguments->select,
                    "scene: does the data need interreflection, gloss, or more than one band?");
  command->footer(
      "Examples:\n  truebox fit reference/llanos_narrowband/measurement.toml -o fit.json\n"
      "  truebox fit box.toml -o fit.json --report out/fit     box.toml names scene and "
      "photographs,\n"
      "                                                         what is fixed, free or has a "
      "prior\n"
      "Ctrl-C ends the fit of a scene with the best so far; before there is one, without a file. "
      "exit code 5 if a fit did not converge or is rank deficient (the null direction is named)");
  command->callback([arguments, &chosen] { chosen = [arguments] { return fit(*arguments); }; });
}

}  // namespace truebox::app

// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "box_report.h"
#include "chart_report.h"
#include "commands.h"
#include "document/writers.h"
#include "image/image_file.h"
#include "image/spectral_image.h"
#include "scene/scene_file.h"
#include "validation_checks.h"
#include "version.h"

namespace truebox::app {
namespace {

struct DemoArguments {
  std::string directory = "out/demo";
  std::size_t elements = PredictOptions{}.elements;
  bool quiet = false;
};

RenderedImage render_box(const Predicted& predicted, const std::filesystem::path& directory,
                         const Observer& observer, const Progress& progress) {
  CameraDescription camera = predicted.scene.cameras.at("front");
  camera.pixels = {256, 256};  // those of the independent render
  RenderOptions options;
  options.progress = progress;
  RenderedImage image = render(*predicted.prediction, Camera(camera), options);
  Image shown = image.radiance;
  add_display_channels(shown, predicted.scene.bands, observer);
  shown.attributes["source"] = "truebox prediction (simulated) of the measured Cornell Box";
  write_exr(directory / "cornell_box.exr", shown);
  write_exr(directory / "cornell_box_error_bound.exr", image.error_bound);
  return image;
}

int demo(const DemoArguments& a) {
  const std::filesystem::path reference = reference_directory(), directory = a.directory;
  const Progress progress = terminal_progress(a.quiet);

  fmt::print("1/4  the measured Cornell Box: solve and render\n");
  PredictionArguments arguments;
  arguments.scene = (reference / "cornell_box" / "cornell_box.toml").string();
  arguments.elements = a.elements;
  arguments.quiet = a.quiet;
  const auto predicted = predict(arguments);
  if (predicted->prediction->outcome() != SolveOutcome::converged) {
    fmt::print(stderr, "truebox: the solver did not reach its bound\n");
    return kNotSolved;
  }
  const Observer observer =
      read_observer(reference / "colour" / "cie1931_2deg_xyz.csv", "CIE 1931 2 deg");
  const RenderedImage image = render_box(*predicted, directory, observer, progress);
  fmt::print("{}", describe(*predicted));

  fmt::print("2/4  closed forms and certified values\n");
  std::vector<AccuracyCheck> accuracy =
      run_validation(reference, kClosedForms, a.elements, progress);
  const auto probes = check_cornell_box_probes(reference, *predicted->prediction);
  accuracy.insert(accuracy.end(), probes.begin(), probes.end());

  fmt::print("3/4  the chart's photographs: dark, exposures, reflectances\n");
  const ChartMeasurement measurement = measure_chart(
      read_measurement(reference / "llanos_narrowband" / "measurement.toml"), progress);
  if (measurement.outcome() != Outcome::converged) {
    fmt::print(stderr, "truebox: the chart's reflectances could not be fitted\n");
    return kNotSolved;
  }

  fmt::print("4/4  the report\n");
  const ReportPart box = box_report(*predicted, image, accuracy, reference);
  const Requirements chart_plan =
      requirements(read_scene(reference / "llanos_narrowband" / "chart.toml"));
  const ReportPart chart = chart_report(measurement, chart_plan, reference / "colour");
  Report report;
  report.title = "Is this simulation of light true?";
  report.subtitle =
      "A measured Cornell Box predicted and held against independent path tracing; a ColorChecker "
      "photographed under seven narrow-band filters and held against its spectrometer readings";
  report.checks = box.checks;
  report.checks.insert(report.checks.end(), chart.checks.begin(), chart.checks.end());
  const Agreement outcome = worst_outcome(report.checks);
  std::string sentence = chart.sentence + "; " + box.sentence + ".";
  report.verdict = {outcome, sentence};
  report.key_numbers = {
      {"Certified checks passed",
       static_cast<double>(std::count_if(accuracy.begin(), accuracy.end(),
                                         [](const AccuracyCheck& c) { return c.passed(); })),
       "", 3, fmt::format("of {}", accuracy.size())},
      {"Error bound of the render", box.checks[2].measured, "%", 2, "of the mean radiance"},
      {"Chart readings that agree", static_cast<double>(measurement.agreeing()), "", 3,
       fmt::format("of {}, k = 2, held out", measurement.held_out())},
      {"Largest |E_n|", chart.checks.back().measured, "", 3,
       fmt::format("limit {:.2f}, family-wise", chart.checks.back().limit)}};
  report.sections = chart.sections;
  report.sections.insert(report.sections.begin() + 1, box.sections.begin(), box.sections.end());
  report.provenance = {{"Program", std::string("truebox ") + kVersion},
                       {"Elements", fmt::format("{}", predicted->prediction->fine().mesh.size())}};
  report.provenance.insert(report.provenance.end(), box.provenance.begin(), box.provenance.end());
  report.provenance.insert(report.provenance.end(), chart.provenance.begin(),
                           chart.provenance.end());
  write_report(directory, report);

  fmt::print("\n{}: {}\nreport: {}\n", to_text(outcome), sentence,
             std::filesystem::absolute(directory / "report.html").string());
  return exit_code(outcome);
}

}  // namespace

void add_demo_command(CLI::App& program, Action& chosen) {
  auto* command = program.add_subcommand(
      "demo", "the main job on the shipped measurements: predict, measure, compare, report");
  auto arguments = std::make_shared<DemoArguments>();
  command->add_option("-o,--output", arguments->directory, "folder of the report")
      ->capture_default_str();
  command->add_option("--elements", arguments->elements, "elements of the Cornell Box")
      ->capture_default_str();
  command->add_flag("--quiet", arguments->quiet, "no progress");
  command->footer("Example: truebox demo -o out/demo\nThe exit code is the verdict's.");
  command->callback([=, &chosen] { chosen = [=] { return demo(*arguments); }; });
}

}  // namespace truebox::app

// SPDX-License-Identifier: BSD-3-Clause
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cctype>
#include <filesystem>
#include <memory>

#include "calibration_report.h"
#include "commands.h"
#include "document/writers.h"
#include "image/image_file.h"

namespace truebox::app {
namespace {

struct CalibrateArguments {
  std::string measurement;
  std::string directory = "calibrated";
};

std::string file_name(const std::string& band) {
  std::string name;
  for (char c : band)
    if (c != ' ') name += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return name;
}

int calibrate(const CalibrateArguments& arguments) {
  const MeasurementFile file = read_measurement(arguments.measurement);
  const bool terminal = isatty(STDERR_FILENO) != 0;
  const PhotometricCalibration calibration =
      calibrate_photographs(file, [&](const std::string& stage, double) {
        if (terminal) std::fprintf(stderr, "\r\033[K%s", stage.c_str());
      });
  if (terminal) std::fprintf(stderr, "\r\033[K");
  const std::filesystem::path directory = arguments.directory;
  std::filesystem::create_directories(directory);
  std::vector<std::string> files;
  std::string budgets;
  for (const LinearPhotograph& photograph : calibration.photographs) {
    const std::string name = file_name(photograph.band);
    files.push_back(name + ".exr");
    write_exr(directory / files.back(), to_image(photograph, file));
    const auto png = encode_png_rgb8(photograph.width, photograph.height, flag_overlay(photograph));
    write_file_atomically(directory / (name + "_overlay.png"), png.data(), png.size());
    budgets += budget_text(photograph) + "\n";
  }
  write_file_atomically(directory / "budget.txt", budgets);
  write_file_atomically(directory / "calibration.json", calibration_json(calibration, files));
  const Report report = calibration_report(calibration);
  write_report(directory, report);
  std::printf("%s\n%s\n", report.verdict.sentence.c_str(), (directory / "report.html").c_str());
  return kAgrees;
}

}  // namespace

void add_calibrate_command(CLI::App& program, Action& chosen) {
  auto* command = program.add_subcommand(
      "calibrate",
      "a camera's files to linear photographs: dark, flat, defects, noise, response, merge, glare");
  auto arguments = std::make_shared<CalibrateArguments>();
  command->add_option("MEASUREMENT", arguments->measurement, "measurement file (TOML)")->required();
  command->add_option("-o,--output", arguments->directory, "directory to write into")
      ->capture_default_str();
  command->footer(
      "Example:\n  truebox calibrate reference/llanos_narrowband/measurement.toml -o calibrated\n"
      "writes for each band an OpenEXR file (value, u_noise, u_common, variance, exposures, "
      "flags)\n"
      "and an overlay picture; calibration.json, budget.txt and report.html for all of them.\n"
      "The measurement file may name dark, flat and defect files, gain and read noise, a glare\n"
      "target, an absolute scale and the response: see calibration/README.md");
  command->callback(
      [arguments, &chosen] { chosen = [arguments] { return calibrate(*arguments); }; });
}

}  // namespace truebox::app

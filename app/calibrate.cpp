// SPDX-License-Identifier: BSD-3-Clause
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cctype>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "fit/chart_measurement.h"
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
  return name + ".exr";
}

nlohmann::json instrument_json(const InstrumentEstimate& instrument) {
  const auto& response = instrument.response.response;
  nlohmann::json darks = nlohmann::json::array();
  for (const auto& dark : instrument.darks)
    darks.push_back({{"exposure_s", dark.exposure_s},
                     {"average_dn", dark.average_dn},
                     {"clipped_fraction", dark.clipped_fraction}});
  return {{"noise_floor_dn2", instrument.noise.floor_dn2},
          {"gain_dn", instrument.noise.gain_dn},
          {"offset_dn", response.offset_dn.value},
          {"offset_u_dn", response.offset_dn.standard_uncertainty},
          {"curvature_per_dn", response.curvature_per_dn.value},
          {"curvature_u_per_dn", response.curvature_per_dn.standard_uncertainty},
          {"response_chi2_per_dof", instrument.response.chi2_per_dof},
          {"response_chi2_per_dof_if_linear", instrument.response.chi2_per_dof_linear},
          {"darks", darks}};
}

nlohmann::json band_json(const MergeResult& band) {
  return {{"band", band.photograph.band},
          {"file", file_name(band.photograph.band)},
          {"exposures_s", band.exposures_s},
          {"mean_ratio", band.mean_ratio},
          {"linearity_chi2_per_dof", band.chi2_per_dof},
          {"linearity_dof", band.dof}};
}

int calibrate(const CalibrateArguments& arguments) {
  const MeasurementFile file = read_measurement(arguments.measurement);
  const Chart chart =
      read_chart(file.chart.labels_path, file.chart.reflectance_path, file.chart.patches);
  const bool terminal = isatty(STDERR_FILENO) != 0;
  const LinearPhotographs linear =
      merge_photographs(file, chart, [&](const std::string& stage, double) {
        if (terminal) std::fprintf(stderr, "\r\033[K%s", stage.c_str());
      });
  if (terminal) std::fprintf(stderr, "\r\033[K");
  const std::filesystem::path directory = arguments.directory;
  std::filesystem::create_directories(directory);
  nlohmann::json json{{"title", file.title},
                      {"measurement", file.path},
                      {"source", file.provenance.source},
                      {"unit", "DN s^-1"},
                      {"instrument", instrument_json(linear.instrument)}};
  for (const MergeResult& band : linear.bands) {
    write_exr(directory / file_name(band.photograph.band), to_image(band.photograph));
    json["bands"].push_back(band_json(band));
  }
  write_file_atomically(directory / "calibration.json", json.dump(2) + "\n");
  std::printf("%zu linear photographs with variance in %s\n", linear.bands.size(),
              directory.c_str());
  return kAgrees;
}

}  // namespace

void add_calibrate_command(CLI::App& program, Action& chosen) {
  auto* command = program.add_subcommand(
      "calibrate", "dark, noise, response, exposure merge: linear photographs with a variance");
  auto arguments = std::make_shared<CalibrateArguments>();
  command->add_option("MEASUREMENT", arguments->measurement, "measurement file (TOML)")->required();
  command->add_option("-o,--output", arguments->directory, "directory to write into")
      ->capture_default_str();
  command->footer(
      "Example:\n  truebox calibrate reference/llanos_narrowband/measurement.toml -o calibrated\n"
      "writes an OpenEXR file a band (value, variance, exposures used) and calibration.json");
  command->callback(
      [arguments, &chosen] { chosen = [arguments] { return calibrate(*arguments); }; });
}

}  // namespace truebox::app

// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <map>
#include <memory>

#include "commands.h"
#include "export/scene_export.h"
#include "scene/scene_file.h"

namespace truebox::app {
namespace {

struct ExportArguments {
  std::string scene, to, output, camera;
  std::vector<double> rgb_bands_nm;
};

const std::map<std::string, ExportFormat>& formats() {
  static const std::map<std::string, ExportFormat> kFormats = {{"mitsuba", ExportFormat::mitsuba},
                                                               {"pbrt", ExportFormat::pbrt},
                                                               {"radiance", ExportFormat::radiance},
                                                               {"obj", ExportFormat::obj},
                                                               {"gltf", ExportFormat::gltf}};
  return kFormats;
}

int export_to(const ExportArguments& a) {
  ExportOptions options;
  options.observer = read_observer(
      std::filesystem::path(reference_directory()) / "colour" / "cie1931_2deg_xyz.csv",
      "CIE 1931 2 deg");
  options.camera = a.camera;
  if (a.rgb_bands_nm.size() == 3)
    options.rgb_bands_nm = {a.rgb_bands_nm[0], a.rgb_bands_nm[1], a.rgb_bands_nm[2]};
  const ExportSummary summary =
      export_scene(read_scene(a.scene), formats().at(a.to), a.output, options);
  fmt::print("{}", summary.files.front().string());
  if (summary.files.size() > 1) fmt::print(" and {} more", summary.files.size() - 1);
  fmt::print("\n");
  for (const std::string& note : summary.notes) fmt::print("  {}\n", note);
  return kAgrees;
}

}  // namespace

void add_export_command(CLI::App& program, Action& chosen) {
  auto* command = program.add_subcommand(
      "export", "the same scene for another renderer, with that renderer's units");
  auto arguments = std::make_shared<ExportArguments>();
  std::vector<std::string> names;
  for (const auto& [name, format] : formats()) names.push_back(name);
  command->add_option("SCENE", arguments->scene, "scene file (TOML)")->required();
  command->add_option("--to", arguments->to, "mitsuba, pbrt, radiance, obj or gltf")
      ->required()
      ->check(CLI::IsMember(names));
  command
      ->add_option("-o,--output", arguments->output,
                   "folder, or file with the format's ending (.gltf with .bin, or .glb)")
      ->required();
  command->add_option("--camera", arguments->camera, "the camera, where a file holds but one");
  command
      ->add_option("--rgb-bands", arguments->rgb_bands_nm,
                   "for radiance, obj and gltf: the bands (nm) that R, G and B carry")
      ->expected(3);
  command->footer(
      "Example: truebox export reference/cornell_box/cornell_box.toml --to pbrt -o box.pbrt");
  command->callback([=, &chosen] { chosen = [=] { return export_to(*arguments); }; });
}

}  // namespace truebox::app

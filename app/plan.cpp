// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "image/image_file.h"
#include "prediction_options.h"
#include "scene/scene_file.h"

namespace truebox::app {
namespace {

int plan(const std::string& path, const std::string& json_file, std::size_t elements) {
  const Scene scene = read_scene(path);
  const Requirements needs = requirements(scene);
  const bool has_matrix = needs.interreflection && !needs.path_tracing;
  const std::size_t bytes = has_matrix ? elements * elements * sizeof(double) : 0;
  std::string text = fmt::format("{}: {} surfaces, {} materials, {} bands\n", path,
                                 scene.surfaces.size(), scene.materials.size(), scene.bands.size());
  for (const auto& reason : needs.reasons) text += "  " + reason + "\n";
  text += needs.path_tracing ? "  method: path tracing (`truebox render --method path`)\n"
          : needs.interreflection
              ? fmt::format(
                    "  method: full matrix of form factors, {} elements, {} MiB; three grids, "
                    "constant elements, conjugate gradients\n",
                    elements, bytes >> 20)
              : "  method: direct light only, no form factors\n";
  fmt::print("{}", text);
  if (json_file.empty()) return kAgrees;
  nlohmann::json json = {{"scene", path},
                         {"surfaces", scene.surfaces.size()},
                         {"bands", scene.bands.size()},
                         {"bands_solved", needs.distinct_bands.size()},
                         {"occlusion", needs.occlusion},
                         {"interreflection", needs.interreflection},
                         {"path_tracing", needs.path_tracing},
                         {"form_factor_bytes", bytes},
                         {"reasons", needs.reasons}};
  write_file_atomically(json_file, json.dump(2) + "\n");
  return kAgrees;
}

}  // namespace

void add_plan_command(CLI::App& program, Action& chosen) {
  auto* command =
      program.add_subcommand("plan", "what a scene requires, what is left out, and why");
  auto scene = std::make_shared<std::string>(), json = std::make_shared<std::string>();
  auto elements = std::make_shared<std::size_t>(PredictOptions{}.elements);
  command->add_option("SCENE", *scene, "scene file (TOML)")->required();
  command->add_option("--json", *json, "also write the plan as JSON");
  command->add_option("--elements", *elements, "elements to plan for")->capture_default_str();
  command->footer("Example: truebox plan reference/cornell_box/cornell_box.toml");
  command->callback([=, &chosen] { chosen = [=] { return plan(*scene, *json, *elements); }; });
}

}  // namespace truebox::app

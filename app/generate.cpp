// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "commands.h"
#include "image/image_file.h"
#include "scene/generated_scene.h"

namespace truebox::app {
namespace {

int generate(const GeneratedSceneOptions& options, const std::string& output) {
  const std::string text = generated_scene(options);
  if (output.empty())
    fmt::print("{}", text);
  else
    write_file_atomically(output, text);
  return kAgrees;
}

}  // namespace

void add_generate_command(CLI::App& program, Action& chosen) {
  auto* command = program.add_subcommand("generate", "a large scene of a documented kind");
  auto options = std::make_shared<GeneratedSceneOptions>();
  auto output = std::make_shared<std::string>();
  command
      ->add_option("KIND", options->kind,
                   "factory: halls with skylights, columns, machines and offices; museum: rooms "
                   "with doors, skylights, columns and exhibits")
      ->required()
      ->check(CLI::IsMember(generated_scene_kinds()));
  command->add_option("--patches", options->patches, "elements that the scene is to be solved with")
      ->capture_default_str()
      ->check(CLI::Range(1000, 10000000));
  command->add_option("--seed", options->seed, "places, sizes and colours")->capture_default_str();
  command->add_option("-o,--output", *output, "scene file (TOML); stdout if not given");
  command->footer(
      "Example: truebox generate museum --patches 50000 -o museum.toml\n"
      "         truebox solve museum.toml --elements 50000 --form-factors hierarchical");
  command->callback([=, &chosen] { chosen = [=] { return generate(*options, *output); }; });
}

}  // namespace truebox::app

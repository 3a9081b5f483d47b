// SPDX-License-Identifier: BSD-3-Clause
#include "sensor/render.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "commands.h"
#include "image/image_file.h"
#include "image/spectral_image.h"
#include "prediction_options.h"
#include "radiometry/input_error.h"
#include "scene/scene_file.h"
#include "sensor_options.h"

namespace truebox::app {
namespace {

struct RenderArguments {
  PredictionArguments prediction;
  std::string camera, output, error_bound;
  std::vector<int> pixels;
  SensorArguments sensor;
};

const CameraDescription& find_camera(const Scene& scene, const std::string& name) {
  std::string known;
  for (const auto& [key, camera] : scene.cameras) {
    if (key == name || (name.empty() && scene.cameras.size() == 1)) return camera;
    known += (known.empty() ? "" : ", ") + key;
  }
  throw InputError(scene.path, 0, "one of the cameras: " + (known.empty() ? "(none)" : known),
                   name.empty() ? "no --camera" : "\"" + name + "\"");
}

double mean_share(const RenderedImage& image) {
  double bound = 0.0, radiance = 0.0;
  for (std::size_t c = 0; c < image.radiance.channels.size(); ++c)
    for (std::size_t i = 0; i < image.radiance.pixel_count(); ++i) {
      bound += image.error_bound.channels[c].samples[i];
      radiance += image.radiance.channels[c].samples[i];
    }
  return radiance > 0.0 ? bound / radiance : 0.0;
}

int render_scene(const RenderArguments& a) {
  const auto observer = read_observer(
      std::filesystem::path(reference_directory()) / "colour" / "cie1931_2deg_xyz.csv",
      "CIE 1931 2 deg");
  const bool counts = wants_counts(a.sensor, a.output);
  if (!counts && std::filesystem::path(a.output).extension() != ".exr")
    throw InputError(a.output, 0, "an output ending in .exr, .tif or .png", a.output);
  if (counts) {  // before the solve, which may take long
    const Scene scene = read_scene(a.prediction.scene);
    check_sensor(a.sensor, a.output, scene, find_camera(scene, a.camera));
  }
  const auto predicted = predict(a.prediction);
  if (predicted->prediction->outcome() != SolveOutcome::converged) {
    fmt::print(stderr, "truebox: the solver did not reach its bound\n");
    return kNotSolved;
  }
  CameraDescription description = find_camera(predicted->scene, a.camera);
  if (a.pixels.size() == 2) description.pixels = {a.pixels[0], a.pixels[1]};
  RenderOptions options;
  options.progress = terminal_progress(a.prediction.quiet);
  const auto start = std::chrono::steady_clock::now();
  RenderedImage image = render(*predicted->prediction, Camera(description), options);
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const double share = mean_share(image);
  add_display_channels(image.radiance, predicted->scene.bands, observer);
  image.radiance.attributes["source"] =
      "truebox prediction (simulated) of " + predicted->scene.path;
  image.radiance.attributes["errorBound"] = fmt::format("{:.3g} of the mean radiance", share);
  image.error_bound.attributes["source"] = "error bound of " + a.output;
  std::string photograph;
  if (counts)
    photograph = write_simulated_photograph(a.sensor, a.output, predicted->scene, description,
                                            image.radiance);
  else
    write_exr(a.output, image.radiance);
  if (!a.error_bound.empty()) write_exr(a.error_bound, image.error_bound);
  fmt::print(
      "{}  render: {} x {} pixels, {:.2f} s, mean error bound {:.2f} % of the mean radiance\n"
      "{}",
      describe(*predicted), description.pixels[0], description.pixels[1], seconds, 100.0 * share,
      photograph);
  return kAgrees;
}

}  // namespace

void add_render_command(CLI::App& program, Action& chosen) {
  auto* command = program.add_subcommand(
      "render", "the spectral radiance a camera would see, or a simulated photograph");
  auto arguments = std::make_shared<RenderArguments>();
  add_prediction_options(*command, arguments->prediction);
  command->add_option("--camera", arguments->camera, "name of the camera in the scene");
  command
      ->add_option("-o,--output", arguments->output,
                   "spectral OpenEXR, with R, G, B; .tif or .png: sensor counts")
      ->required();
  command->add_option("--error-bound", arguments->error_bound,
                      "OpenEXR of the bound of each pixel and band");
  command->add_option("--pixels", arguments->pixels, "width and height instead of the scene's")
      ->expected(2)
      ->check(CLI::Range(1, 32768));
  add_sensor_options(*command, arguments->sensor);
  command->footer(
      "Example: truebox render reference/cornell_box/cornell_box.toml --camera front -o box.exr");
  command->callback([=, &chosen] { chosen = [=] { return render_scene(*arguments); }; });
}

}  // namespace truebox::app

// SPDX-License-Identifier: BSD-3-Clause
#include "sensor/render.h"

#include <fmt/format.h>
#include <tbb/global_control.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>

#include "camera_attribute.h"
#include "commands.h"
#include "image/image_file.h"
#include "image/spectral_image.h"
#include "job_array.h"
#include "path_tracer/path_tracer.h"
#include "plan_settings.h"
#include "prediction_options.h"
#include "radiometry/input_error.h"
#include "scene/lamp_spectrum.h"
#include "scene/scene_file.h"
#include "sensor/aovs.h"
#include "sensor_options.h"

namespace truebox::app {
namespace {

struct RenderArguments {
  PredictionArguments prediction;
  std::string camera, output, error_bound, variance, standard_error, aovs, filter = "box";
  std::vector<int> pixels;
  int samples = 0;  // 0: as many as the method takes by itself
  std::uint64_t seed = 1;
  double gather_above_percent = -1.0;
  SensorArguments sensor;
  ArrayArguments array;
};

double mean_share(const RenderedImage& image) {
  double bound = 0.0, radiance = 0.0;
  for (std::size_t c = 0; c < image.radiance.channels.size(); ++c)
    for (std::size_t i = 0; i < image.radiance.pixel_count(); ++i) {
      bound += image.error_bound.channels[c].samples[i];
      radiance += image.radiance.channels[c].samples[i];
    }
  return radiance > 0.0 ? bound / radiance : 0.0;
}

CameraDescription camera_of(const Scene& scene, const RenderArguments& a) {
  CameraDescription description = find_camera(scene, a.camera);
  if (a.pixels.size() == 2) description.pixels = {a.pixels[0], a.pixels[1]};
  return description;
}

PixelFilter filter_of(const RenderArguments& a) {
  return a.filter == "tent" ? PixelFilter::tent : PixelFilter::box;
}

// R, G, B again where the lamps' table is finer than the bands: light is not even in those.
void follow_lamps(Image& radiance, const Scene& scene, const Observer& observer) {
  const auto weights = display_weights(scene, observer);
  if (weights.front().Y == band_weights(scene.bands, observer).front().Y) return;
  const SpectralChannels bands = spectral_channels(radiance);
  for (std::size_t pixel = 0; pixel < radiance.pixel_count(); ++pixel) {
    Tristimulus xyz;
    for (std::size_t b = 0; b < weights.size(); ++b) {
      const double value = radiance.channels[bands.indices[b]].samples[pixel];
      xyz.X += value * weights[b].X;
      xyz.Y += value * weights[b].Y;
      xyz.Z += value * weights[b].Z;
    }
    const LinearRgb rgb = linear_bt709(xyz);
    const char* const names[] = {"R", "G", "B"};
    for (std::size_t c = 0; c < 3; ++c)
      for (Channel& channel : radiance.channels)
        if (channel.name == names[c]) channel.samples[pixel] = static_cast<float>(rgb[c]);
  }
}

// The picture, or the photograph that a sensor would make of it; what there is to say of the
// latter.
std::string write_picture(const RenderArguments& a, const Scene& scene, Image& radiance,
                          const std::string& how) {
  const auto observer = read_observer(
      std::filesystem::path(reference_directory()) / "colour" / "cie1931_2deg_xyz.csv",
      "CIE 1931 2 deg");
  add_display_channels(radiance, scene.bands, observer);
  follow_lamps(radiance, scene, observer);
  radiance.attributes["source"] = "truebox " + how + " (simulated) of " + scene.path;
  note_camera(radiance, scene, camera_of(scene, a));
  if (wants_counts(a.sensor, a.output))
    return write_simulated_photograph(a.sensor, a.output, scene, camera_of(scene, a), radiance);
  write_exr(a.output, radiance);
  return {};
}

void write_aovs(const RenderArguments& a, const Scene& scene, Image aovs) {
  note_camera(aovs, scene, camera_of(scene, a));
  write_exr(a.aovs, aovs);
}

class Stopwatch {
 public:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

int render_radiosity(RenderArguments a) {
  if (a.prediction.method == "radiosity") a.prediction.method = "krylov";
  if (a.prediction.adaptive == kDefaultGoal && !a.camera.empty())
    a.prediction.adaptive = "camera:" + a.camera;
  const auto predicted = predict(a.prediction);
  if (predicted->prediction->outcome() != SolveOutcome::converged) {
    fmt::print(stderr, "truebox: the solver did not reach its bound\n");
    return kNotSolved;
  }
  const Camera camera(camera_of(predicted->scene, a));
  RenderOptions options;
  options.progress = terminal_progress(a.prediction.quiet);
  options.filter = filter_of(a);
  if (a.samples > 0) options.edge_samples = 16 * (options.samples = a.samples);
  if (a.gather_above_percent >= 0.0) options.gather_above = 0.01 * a.gather_above_percent;
  const Stopwatch watch;
  RenderedImage image = render(*predicted->prediction, camera, options);
  const double seconds = watch.seconds(), share = mean_share(image);
  image.radiance.attributes["errorBound"] = fmt::format("{:.3g} of the mean radiance", share);
  image.error_bound.attributes["source"] = "error bound of " + a.output;
  if (!a.aovs.empty()) write_aovs(a, predicted->scene, render_aovs(*predicted->prediction, camera));
  const std::string photograph = write_picture(a, predicted->scene, image.radiance, "prediction");
  if (!a.error_bound.empty()) write_exr(a.error_bound, image.error_bound);
  fmt::print("{}  render: {} x {} pixels, {} points each, {} in {} of them, {:.2f} s\n",
             describe(*predicted), camera.width_px(), camera.height_px(), options.samples,
             options.edge_samples, image.edge_pixels, seconds);
  if (image.gathered_pixels > 0) fmt::print("  final gather: {} pixels\n", image.gathered_pixels);
  fmt::print("  mean error bound {:.2f} % of the mean radiance\n{}", 100.0 * share, photograph);
  return kAgrees;
}

double median_relative_error(const PathTracedImage& image) {
  std::vector<double> shares;
  // The variance's channels: the picture's may have been joined by R, G, B.
  for (std::size_t c = 0; c < image.variance.channels.size(); ++c)
    for (std::size_t i = 0; i < image.variance.pixel_count(); ++i)
      if (const double value = image.radiance.channels[c].samples[i]; value > 0.0)
        shares.push_back(std::sqrt(image.variance.channels[c].samples[i]) / value);
  if (shares.empty()) return 0.0;
  const auto middle = shares.begin() + static_cast<std::ptrdiff_t>(shares.size() / 2);
  std::nth_element(shares.begin(), middle, shares.end());
  return *middle;
}

std::optional<PixelRay> pixel_ray(const std::optional<Ray>& ray) {
  if (!ray) return std::nullopt;
  return PixelRay{ray->origin_m, ray->direction};
}

int render_paths(const RenderArguments& a) {
  const Scene scene = read_scene_of(a.prediction);
  const Camera camera(camera_of(scene, a));
  std::unique_ptr<tbb::global_control> limit;
  if (a.prediction.threads > 0)
    limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                  static_cast<std::size_t>(a.prediction.threads));
  PathTraceOptions options;
  options.seed = a.seed;
  options.progress = terminal_progress(a.prediction.quiet);
  if (a.samples > 0) options.samples = a.samples;
  const PixelFilter filter = filter_of(a);
  const Stopwatch watch;
  PathTracedImage image = trace_paths(
      scene, camera.width_px(), camera.height_px(),
      [&](int x, int y, UnitPair at) {
        return pixel_ray(camera.ray(
            {x + filtered_position_px(filter, at.u), y + filtered_position_px(filter, at.v)}));
      },
      options);
  const double seconds = watch.seconds();
  const std::string how =
      fmt::format("path tracing, {} paths a pixel in {} independent sets, seed {}", image.samples,
                  image.randomisations, a.seed);
  image.variance.attributes["source"] = "variance of the mean of " + a.output;
  image.variance.attributes["degreesOfFreedom"] = std::to_string(image.randomisations - 1);
  if (!a.aovs.empty()) write_aovs(a, scene, geometry_aovs(scene, camera));
  const std::string photograph = write_picture(a, scene, image.radiance, how);
  if (!a.variance.empty()) write_exr(a.variance, image.variance);
  if (!a.standard_error.empty()) {
    Image error = image.standard_error();
    error.attributes["source"] = "standard error of " + a.output;
    write_exr(a.standard_error, error);
  }
  fmt::print("{}: {} bands\n  {}\n  render: {} x {} pixels, {:.2f} s\n", scene.path,
             scene.bands.size(), how, camera.width_px(), camera.height_px(), seconds);
  fmt::print("  standard error of a pixel, median: {:.2f} % of its radiance\n{}",
             100.0 * median_relative_error(image), photograph);
  return kAgrees;
}

[[noreturn]] void refuse(const std::string& option, const std::string& method) {
  throw CLI::ValidationError(option, "belongs to --method " + method);
}

void require_fitting_options(const RenderArguments& a) {
  const bool paths = a.prediction.method == "path";
  if (paths && !a.error_bound.empty()) refuse("--error-bound", "radiosity; path has --variance");
  if (paths && a.gather_above_percent >= 0.0) refuse("--gather-above", "radiosity");
  if (paths && !a.prediction.adaptive.empty()) refuse("--adaptive", "radiosity");
  if (paths && a.prediction.gather_edges) refuse("--gather-edges", "radiosity");
  if (!paths && !a.variance.empty()) refuse("--variance", "path; radiosity has --error-bound");
  if (!paths && !a.standard_error.empty())
    refuse("--standard-error", "path; radiosity has --error-bound");
}

// By the method that the plan for this camera chooses.
int render_planned(RenderArguments a) {
  const Scene scene = read_scene_of(a.prediction);
  if (a.prediction.automatic == kDefaultGoal && !a.camera.empty())
    a.prediction.automatic = "camera:" + a.camera;
  const Plan plan = plan_for(scene, a.prediction);
  a.prediction = applied(plan, a.prediction);
  fmt::print("as planned: {}\n", command_line(plan, a.prediction));
  if (plan.method != PlannedMethod::path_tracing) return render_radiosity(a);
  if (a.samples == 0) a.samples = std::max(16, plan.paths);
  return render_paths(a);
}

int render_scene(const RenderArguments& a) {
  const bool counts = wants_counts(a.sensor, a.output);
  if (!counts && std::filesystem::path(a.output).extension() != ".exr")
    throw InputError(a.output, 0, "an output ending in .exr, .tif or .png", a.output);
  if (counts) {  // before the solve, which may take long
    const Scene scene = read_scene_of(a.prediction);
    check_sensor(a.sensor, a.output, scene, find_camera(scene, a.camera));
  }
  if (!a.prediction.automatic.empty()) return render_planned(a);
  return a.prediction.method == "path" ? render_paths(a) : render_radiosity(a);
}

}  // namespace

void add_render_command(CLI::App& program, Action& chosen) {
  auto* command = program.add_subcommand(
      "render", "the spectral radiance a camera would see, or a simulated photograph");
  auto arguments = std::make_shared<RenderArguments>();
  arguments->prediction.method = "radiosity";
  add_prediction_options(*command, arguments->prediction, {"radiosity", "path"});
  add_array_options(*command, arguments->array);
  command->add_option("--camera", arguments->camera, "name of the camera in the scene");
  command
      ->add_option("-o,--output", arguments->output,
                   "spectral OpenEXR, with R, G, B; .tif or .png: sensor counts")
      ->required();
  command->add_option("--error-bound", arguments->error_bound,
                      "radiosity: OpenEXR of the bound of each pixel and band");
  command->add_option("--variance", arguments->variance,
                      "path: OpenEXR of the variance of each pixel and band");
  command->add_option("--standard-error", arguments->standard_error,
                      "path: OpenEXR of its square root");
  command->add_option("--aov", arguments->aovs,
                      "OpenEXR of surface, position, normal and coverage at each pixel's centre; "
                      "radiosity: irradiance and its bound, too");
  command->add_option("--pixels", arguments->pixels, "width and height instead of the scene's")
      ->expected(2)
      ->check(CLI::Range(1, 32768));
  command
      ->add_option(
          "--samples,--samples-per-pixel", arguments->samples,
          "path: paths of a pixel (256); radiosity: points of an even pixel (16), 16 times "
          "as many where an edge or a shadow crosses it")
      ->check(CLI::Range(1, 1 << 24));
  command->add_option("--seed", arguments->seed, "path: another seed is another picture")
      ->capture_default_str();
  command->add_option("--filter", arguments->filter, "pixel filter: box or tent")
      ->capture_default_str()
      ->check(CLI::IsMember({"box", "tent"}));
  command->add_flag("--gather-edges", arguments->prediction.gather_edges,
                    "radiosity: indirect light gathered in cells that get thinner towards edges, "
                    "where a field over elements misses some percent (several times the time)");
  command
      ->add_option("--gather-above", arguments->gather_above_percent,
                   "radiosity: final gather in pixels whose bound exceeds this many % (slow)")
      ->check(CLI::Range(0.0, 100.0));
  add_sensor_options(*command, arguments->sensor);
  command->footer(
      "Example: truebox render reference/cornell_box/cornell_box.toml --camera front -o box.exr");
  command->callback([=, &chosen] {
    require_fitting_options(*arguments);
    chosen = [=] {
      return arguments->array.is_many()
                 ? run_array(*command, arguments->array, arguments->prediction.scene,
                             arguments->output, ".exr")
                 : render_scene(*arguments);
    };
  });
}

}  // namespace truebox::app

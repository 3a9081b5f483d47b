// SPDX-License-Identifier: BSD-3-Clause
#include "sensor_options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "image/image_file.h"
#include "radiometry/input_error.h"
#include "sensor/exposure.h"
#include "sensor/spectral_responsivity.h"

namespace truebox::app {
namespace {

namespace fs = std::filesystem;

constexpr char kWhatItIs[] = "simulated photograph: computed from a scene, not measured";

bool is_exr(const std::string& output) { return fs::path(output).extension() == ".exr"; }

std::string beside(const std::string& output, const std::string& ending) {
  return fs::path(output).replace_extension(ending).string();
}

nlohmann::json lens_json(const LensDescription& lens) {
  const LensDistortion& d = lens.distortion;
  nlohmann::json json = {{"distortion_opencv",
                          {{"k1", d.k1},
                           {"k2", d.k2},
                           {"p1", d.p1},
                           {"p2", d.p2},
                           {"k3", d.k3},
                           {"k4", d.k4},
                           {"k5", d.k5},
                           {"k6", d.k6},
                           {"s1", d.s1},
                           {"s2", d.s2},
                           {"s3", d.s3},
                           {"s4", d.s4}}},
                         {"principal_point_from_centre_m", lens.principal_point_m},
                         {"vignetting_cos4", lens.cos4},
                         {"vignetting_polynomial", lens.vignetting_polynomial},
                         {"point_spread_sigma_m", lens.point_spread_m},
                         {"veiling_glare", lens.veiling_glare},
                         {"transmittance_tables", lens.transmittances.size()}};
  if (lens.f_number) json["f_number"] = *lens.f_number;
  return json;
}

nlohmann::json sensor_json(const SensorDescription& sensor) {
  nlohmann::json json = {{"exposure_s", sensor.exposure_s},
                         {"gain_dn_per_electron", sensor.gain_dn},
                         {"offset_dn", sensor.offset_dn},
                         {"read_noise_dn", sensor.read_noise_dn},
                         {"dark_current_electrons_per_s", sensor.dark_current_electrons_per_s},
                         {"shot_noise", sensor.shot_noise}};
  for (const SensorChannel& channel : sensor.channels) json["channels"].push_back(channel.name);
  if (sensor.bayer) json["bayer"] = sensor.bayer->name();
  if (sensor.bits > 0) json["bits"] = sensor.bits;
  if (std::isfinite(sensor.full_well_electrons))
    json["full_well_electrons"] = sensor.full_well_electrons;
  return json;
}

std::size_t pixels_without_light_path(const Camera& camera) {
  std::size_t count = 0;
  for (int y = 0; y < camera.height_px(); ++y)
    for (int x = 0; x < camera.width_px(); ++x) count += !camera.ray({x + 0.5, y + 0.5});
  return count;
}

void add_planes(Image& image, const Image& planes, const std::string& layer) {
  for (const Channel& channel : planes.channels)
    image.channels.push_back({layer + "." + channel.name, channel.samples});
  image.attributes["unit:" + layer] = planes.attributes.at("unit");
}

}  // namespace

void add_sensor_options(CLI::App& command, SensorArguments& a) {
  command.add_flag("--counts", a.counts,
                   "a simulated photograph: what the camera's sensor counts, with noise; a .tif or "
                   ".png output means the same");
  auto* exposure = command.add_option("--exposure", a.exposure_s,
                                      "simulated photograph: exposure time, s, for the scene's");
  exposure->check(CLI::NonNegativeNumber);
  command
      .add_option("--auto-exposure", a.auto_exposure_share,
                  "simulated photograph: brightest photosite at this share of saturation")
      ->check(CLI::Range(1e-9, 1e9))
      ->excludes(exposure);
  command.add_option("--noise-seed", a.seed, "simulated photograph: another seed, other noise")
      ->capture_default_str();
}

bool wants_counts(const SensorArguments& a, const std::string& output) {
  const fs::path ending = fs::path(output).extension();
  return a.counts || ending == ".tif" || ending == ".tiff" || ending == ".png";
}

void check_sensor(const SensorArguments& a, const std::string& output, const Scene& scene,
                  const CameraDescription& camera) {
  if (!camera.sensor)
    throw InputError(scene.path, 0, "a camera with a table [cameras.NAME.sensor]", "none");
  const SensorDescription& sensor = *camera.sensor;
  const std::string ending = fs::path(output).extension().string();
  if (!is_exr(output) && ending != ".png" && ending != ".tif" && ending != ".tiff")
    throw InputError(output, 0, "an output ending in .tif, .png or .exr", ending);
  if (!is_exr(output) && (sensor.bits < 1 || sensor.bits > 16))
    throw InputError(scene.path, 0, "a sensor of 1 to 16 bits, or an .exr output",
                     sensor.bits ? fmt::format("{} bits", sensor.bits) : "no bits");
  const std::size_t planes = sensor.bayer ? 1 : sensor.channels.size();
  if (!is_exr(output) && planes != 1 && planes != 3)
    throw InputError(scene.path, 0, "one channel or three, or an .exr output",
                     fmt::format("{} channels", planes));
  if (a.auto_exposure_share > 0.0 && sensor.bits == 0 && !std::isfinite(sensor.full_well_electrons))
    throw InputError(scene.path, 0, "bits or full_well_electrons for --auto-exposure", "neither");
}

std::string write_simulated_photograph(const SensorArguments& a, const std::string& output,
                                       const Scene& scene, const CameraDescription& camera,
                                       const Image& spectral) {
  const PhotoCurrent current =
      photo_current(spectral, scene.bands, luminaire_spectrum(scene), camera);
  SensorDescription sensor = *camera.sensor;
  if (a.exposure_s >= 0.0) sensor.exposure_s = a.exposure_s;
  if (a.auto_exposure_share > 0.0)
    sensor.exposure_s = exposure_reaching(a.auto_exposure_share, current, sensor);
  SensorImage image = read_out(current, sensor, a.seed);
  const std::size_t samples = image.reading.channels.size() * image.reading.pixel_count();
  const std::size_t no_path = pixels_without_light_path(Camera(camera));
  const std::string truth_path = beside(output, ".truth.exr");

  Image truth = spectral;
  add_planes(truth, image.expected, "expected");
  add_planes(truth, image.variance, "variance");
  add_planes(truth, image.clipped, "clipped");
  truth.attributes["simulated"] = "truth of a " + std::string(kWhatItIs);
  truth.attributes["photograph"] = fs::path(output).filename().string();
  write_exr(truth_path, truth);

  if (is_exr(output)) {
    image.reading.attributes["simulated"] = kWhatItIs;
    image.reading.attributes["source"] = "truebox simulated photograph of " + scene.path;
    image.reading.attributes["truth"] = fs::path(truth_path).filename().string();
    image.reading.attributes["exposure_s"] = fmt::format("{}", sensor.exposure_s);
    write_exr(output, image.reading);
  } else {
    write_counts(
        output, image.reading,
        fmt::format("truebox {}; {}; exposure {} s", kWhatItIs, scene.path, sensor.exposure_s));
  }
  const nlohmann::json json = {{"simulated", true},
                               {"what", kWhatItIs},
                               {"scene", scene.path},
                               {"photograph", fs::path(output).filename().string()},
                               {"truth", fs::path(truth_path).filename().string()},
                               {"pixels", camera.pixels},
                               {"focal_length_m", camera.focal_length_m},
                               {"film_m", camera.film_m},
                               {"lens", lens_json(camera.lens)},
                               {"sensor", sensor_json(sensor)},
                               {"noise_seed", a.seed},
                               {"samples", samples},
                               {"saturated_samples", image.saturated},
                               {"below_zero_samples", image.below_zero},
                               {"pixels_outside_lens_field", no_path}};
  write_file_atomically(beside(output, ".json"), json.dump(2) + "\n");

  std::string text = fmt::format(
      "  simulated photograph: exposure {:.4g} s, noise seed {}\n"
      "  clipped: {} of {} samples saturated, {} below zero (flagged in {})\n",
      sensor.exposure_s, a.seed, image.saturated, samples, image.below_zero, truth_path);
  if (no_path > 0) text += fmt::format("  {} pixels lie outside the lens' field: dark\n", no_path);
  return text;
}

}  // namespace truebox::app

// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "fit/scene_measurement_fit.h"
#include "fit/scene_select.h"
#include "image/image_file.h"
#include "radiometry/input_error.h"
#include "scene/scene_file.h"
#include "sensor/render.h"
#include "support/scratch.h"

namespace truebox {
namespace {

using testing::HasSubstr;

constexpr const char* kScene = R"(length_unit = "m"
[bands]
centres_nm = [450, 600]
[materials.grey]
reflectance = { nm = [450, 600], value = [0.6, 0.7] }
[materials.red]
reflectance = { nm = [450, 600], value = [0.1, 0.5] }
[materials.lamp]
reflectance = 0
exitance = 10
[[surfaces]]
name = "floor"
material = "grey"
vertices = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
[[surfaces]]
name = "side"
material = "red"
vertices = [[0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1]]
[[surfaces]]
name = "back"
material = "grey"
vertices = [[0, 1, 0], [1, 1, 0], [1, 1, 1], [0, 1, 1]]
[[surfaces]]
name = "lamp"
material = "lamp"
vertices = [[0.4, 0.3, 1], [0.4, 0.6, 1], [0.7, 0.6, 1], [0.7, 0.3, 1]]
[cameras.front]
position = [0.6, -1.2, 0.5]
direction = [0, 1, 0]
up = [0, 0, 1]
focal_length_mm = 35
film_mm = [36, 36]
pixels = [64, 64]
)";

constexpr const char* kMeasurement = R"(title = "corner"
source = "test"
simulated = "yes"
scene = "fit_scene.toml"
[model]
elements = 300
held_out_share = 0.2
[[photographs]]
file = "fit_photo.exr"
camera = "front"
relative_u = 0.01
block_relative_u = 0.003
[reflectances.grey]
fit = "free"
start = 0.4
[reflectances.red]
fit = "free"
start = 0.4
)";

std::string written(const std::string& name, std::string text, const std::string& from = "",
                    const std::string& to = "") {
  if (!from.empty()) text.replace(text.find(from), from.size(), to);
  const std::string path = scratch_path(name);
  write_file_atomically(path, text);
  return path;
}

/// A picture of the scene by the renderer, on a mesh of its own with ten times as many elements.
const Image& picture() {
  static const Image image = [] {
    const Scene scene = read_scene(written("fit_scene.toml", kScene));
    PredictOptions options;
    options.elements = 3000;
    const Prediction prediction(scene, options);
    Image radiance =
        render(prediction, Camera(scene.cameras.at("front")), RenderOptions{}).radiance;
    for (Channel& c : radiance.channels)
      for (float& v : c.samples) v *= 4.0f;  // the camera's gain
    return radiance;
  }();
  return image;
}

SceneMeasurement measured(const std::string& text = kMeasurement, const Image& photo = picture()) {
  written("fit_scene.toml", kScene);
  write_exr(scratch_path("fit_photo.exr"), photo);
  return read_scene_fit(read_scene_measurement(written("fit.toml", text)));
}

TEST(SceneMeasurement, FindsTheReflectancesOfAPictureFromAFinerMesh) {
  SceneMeasurement m = measured();
  const SceneFit fit = fit_measurement(m, {});
  ASSERT_EQ(fit.summary.outcome, Outcome::converged) << fit.full();
  const Scene truth = read_scene(scratch_path("fit_scene.toml"));
  for (const FittedSpectrum& s : fit.spectra)
    for (std::size_t b = 0; b < 2; ++b) {
      const double rho = truth.materials[s.material].reflectance[b];
      // Three standard uncertainties of four numbers: wrong by chance once in 100.
      EXPECT_LT(std::abs(s.reflectance[b].value - rho),
                3.0 * s.reflectance[b].standard_uncertainty);
      EXPECT_LT(std::abs(s.reflectance[b].value - rho), 0.02 * rho) << "and useful";
    }
  EXPECT_NEAR(fit.parameters.back().estimate.value, 4.0,
              3.0 * fit.parameters.back().estimate.standard_uncertainty);
  const auto held_out = predict_held_out(m.problem, m.held_out, fit);
  ASSERT_GT(held_out.size(), 20u);
  double inside = 0.0;
  for (const FittedReading& r : held_out) inside += std::abs(r.z()) <= 2.0;
  EXPECT_GT(inside / static_cast<double>(held_out.size()), 0.9);
}

TEST(SceneMeasurement, ChoosesInterreflectionAndOneReflectanceABandWhereBothAreThere) {
  SceneMeasurement m = measured();
  const auto candidates = select_model(m.problem, m.held_out, {});
  ASSERT_EQ(candidates.size(), 4u);
  EXPECT_TRUE(candidates[3].chosen) << describe(candidates);
  EXPECT_LT(candidates[3].held_out_rms, 0.5 * candidates[2].held_out_rms);
}

TEST(SceneMeasurement, ChoosesTheSimplerModelWhereItSuffices) {
  SceneMeasurement m = measured();
  // Readings of a grey world: what one reflectance for both bands predicts, with 0.3 % of noise.
  for (ReflectanceChoice& c : m.problem.reflectances) c.basis = SpectralBasis::constant;
  const std::vector<double> grey = predicted_readings(m.problem);
  for (ReflectanceChoice& c : m.problem.reflectances) c.basis = SpectralBasis::bands;
  std::size_t row = 0;
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (PlaneReadings& plane : m.problem.planes)
    for (BlockReading& r : plane.readings) {
      r.standard_uncertainty = 0.003 * grey[row];
      r.value = grey[row++] * (1.0 + 0.003 * normal(random));
    }
  m.held_out.assign(2, {});
  const auto candidates = select_model(m.problem, m.held_out, {});
  EXPECT_TRUE(candidates[1].chosen) << describe(candidates);
  EXPECT_THAT(candidates[3].why, testing::AnyOf(HasSubstr("BIC"), HasSubstr("simpler")));
}

TEST(SceneMeasurement, LeavesOutWhatCannotBeUsedAndCountsIt) {
  Image photo = picture();
  auto& first = photo.channels[0].samples;
  for (std::size_t i = 0; i < first.size(); i += 31) first[i] = std::nanf("");
  std::vector<float> sorted = photo.channels[1].samples;
  std::sort(sorted.begin(), sorted.end());
  const float brightness = sorted[sorted.size() * 98 / 100];
  std::string text = kMeasurement;
  text.replace(text.find("relative_u = 0.01"), 17,
               "relative_u = 0.01\nsaturation = " + std::to_string(brightness));
  SceneMeasurement m = measured(text, photo);
  EXPECT_GT(m.counts[0].not_finite, 10u);
  EXPECT_EQ(m.counts[1].not_finite, 0u);
  EXPECT_GT(m.counts[1].saturated, 20u);
  const SceneFit fit = fit_measurement(m, {});
  EXPECT_EQ(fit.summary.outcome, Outcome::converged) << fit.full();
}

TEST(SceneMeasurement, RefusesAPictureThatIsAllMasked) {
  Image mask(64, 64);
  mask.add_channel("Y", 0.0f);
  write_exr(scratch_path("fit_mask.exr"), mask);
  std::string text = kMeasurement;
  text.replace(text.find("relative_u = 0.01"), 17, "relative_u = 0.01\nmask = \"fit_mask.exr\"");
  SceneMeasurement m = measured(text);
  EXPECT_EQ(m.counts[0].used, 0u);
  const SceneFit fit = fit_measurement(m, {});
  EXPECT_EQ(fit.summary.outcome, Outcome::invalid_problem);
  EXPECT_THAT(fit.summary.message, HasSubstr("masked"));
}

TEST(SceneMeasurement, RefusesAPictureOfAnotherShape) {
  Image photo(64, 32);
  photo.add_channel("S0.450,000000nm", 1.0f);
  EXPECT_THROW(measured(kMeasurement, photo), MismatchError);
}

void expect_refused(const std::string& from, const std::string& to, int line,
                    const std::string& expected) {
  write_exr(scratch_path("fit_photo.exr"), picture());
  const std::string path = written("fit_bad.toml", kMeasurement, from, to);
  try {
    read_scene_fit(read_scene_measurement(path));
    FAIL() << to;
  } catch (const InputError& error) {
    EXPECT_EQ(error.line(), line) << error.what();
    EXPECT_THAT(error.what(), HasSubstr(expected));
  }
}

TEST(SceneMeasurement, NamesFileAndLineOfAMistake) {
  expect_refused("elements", "element", 6, "\"element\"");
  expect_refused("camera = \"front\"", "camera = \"back\"", 8, "a camera of the scene");
  expect_refused("fit = \"free\"\nstart = 0.4\n[", "fit = \"prior\"\n[", 13, "u = ");
  expect_refused("fit = \"free\"", "fit = \"loose\"", 14, "\"free\"");
  expect_refused("reflectances.red", "reflectances.rad", 16, "a material of the scene");
  expect_refused("fit_photo.exr", "no.exr", 9, "an existing file");
  expect_refused("relative_u = 0.01\nblock_relative_u = 0.003", "", 8, "an uncertainty");
}

TEST(SceneMeasurement, KnowsAChartFromAScene) {
  EXPECT_FALSE(is_scene_measurement(std::string(TRUEBOX_REFERENCE_DIR) +
                                    "/llanos_narrowband/measurement.toml"));
  EXPECT_TRUE(is_scene_measurement(written("fit.toml", kMeasurement)));
}

TEST(SceneMeasurement, FindsTheCornellBoxReflectancesInAnotherProgramsPicture) {
  SceneMeasurementFile file = read_scene_measurement(std::string(TRUEBOX_REFERENCE_DIR) +
                                                     "/independent_renders/fit_front.toml");
  file.bands_nm = {552, 652};
  file.elements = 900;
  file.model_bound = false;
  SceneMeasurement m = read_scene_fit(file);
  const SceneFit fit = fit_measurement(m, {});
  ASSERT_EQ(fit.summary.outcome, Outcome::converged) << fit.full();
  const Scene truth = in_bands_at(read_scene(file.scene_path), {552, 652});
  ASSERT_EQ(fit.spectra.size(), 3u);
  for (const FittedSpectrum& s : fit.spectra)
    for (std::size_t b = 0; b < 2; ++b)
      // The published table has three digits; elements of this size are good to some 0.3 %, and
      // three uncertainties of the fit come on top.
      EXPECT_NEAR(s.reflectance[b].value, truth.materials[s.material].reflectance[b],
                  0.003 + 3.0 * s.reflectance[b].standard_uncertainty)
          << truth.materials[s.material].name;
}

}  // namespace
}  // namespace truebox

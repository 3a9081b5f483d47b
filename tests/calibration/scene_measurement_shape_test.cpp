// SPDX-License-Identifier: BSD-3-Clause
// Measurement files whose cameras, surfaces or photosites are not what a plain photograph has.
#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "fit/scene_measurement_fit.h"
#include "image/image_file.h"
#include "radiometry/input_error.h"
#include "scene/scene_file.h"
#include "sensor/render.h"
#include "support/scratch.h"

namespace truebox {
namespace {

using testing::HasSubstr;

constexpr const char* kScene = R"(length_unit = "mm"
[bands]
centres_nm = [450, 600]
[materials.grey]
reflectance = { nm = [450, 600], value = [0.6, 0.7] }
[materials.red]
reflectance = { nm = [450, 600], value = [0.1, 0.5] }
[materials.blue]
reflectance = { nm = [450, 600], value = [0.5, 0.2] }
[materials.lamp]
reflectance = 0
exitance = 10
[[surfaces]]
name = "floor"
material = "grey"
vertices = [[0, 0, 0], [1000, 0, 0], [1000, 1000, 0], [0, 1000, 0]]
[[surfaces]]
name = "side"
material = "red"
vertices = [[0, 0, 0], [0, 1000, 0], [0, 1000, 1000], [0, 0, 1000]]
[[surfaces]]
name = "other side"
material = "blue"
vertices = [[1000, 0, 0], [1000, 0, 1000], [1000, 1000, 1000], [1000, 1000, 0]]
[[surfaces]]
name = "back"
material = "grey"
vertices = [[0, 1000, 0], [1000, 1000, 0], [1000, 1000, 1000], [0, 1000, 1000]]
[[surfaces]]
name = "panel"
material = "blue"
vertices = [[250, 800, 300], [550, 800, 300], [550, 800, 700], [250, 800, 700]]
[[surfaces]]
name = "lamp"
material = "lamp"
vertices = [[400, 300, 1000], [400, 600, 1000], [700, 600, 1000], [700, 300, 1000]]
[cameras.front]
position = [520, -1050, 570]
direction = [0, 1, -0.1]
up = [0, 0, 1]
focal_length_mm = 35
film_mm = [36, 36]
pixels = [96, 96]
)";

constexpr const char* kMeasurement = R"(title = "room"
source = "test"
simulated = "yes"
scene = "shape_scene.toml"
[model]
elements = 400
model_bound = "no"
[[photographs]]
file = "shape_photo.exr"
camera = "front"
relative_u = 0.01
block_relative_u = 0.003
edge_relative_u = 0.01
gain_fit = "free"
[reflectances.grey]
fit = "free"
[reflectances.red]
fit = "free"
[reflectances.blue]
fit = "free"
)";

std::string written(const std::string& name, const std::string& text) {
  const std::string path = scratch_path(name);
  write_file_atomically(path, text);
  return path;
}

/// A picture from another mesh, by a camera that is not quite where the scene has it, with noise.
const Image& picture() {
  static const Image image = [] {
    Scene scene = read_scene(written("shape_scene.toml", kScene));
    CameraDescription camera = scene.cameras.at("front");
    camera.position_m += Vec3(0.006, 0.0, -0.004);
    camera.focal_length_m *= 1.01;
    PredictOptions options;
    options.elements = 1500;
    const Prediction prediction(scene, options);
    Image radiance = render(prediction, Camera(camera), RenderOptions{}).radiance;
    std::mt19937 random(3);
    std::normal_distribution<float> normal;
    for (Channel& c : radiance.channels)
      for (float& v : c.samples) v *= 1.0f + 0.01f * normal(random);
    return radiance;
  }();
  return image;
}

SceneMeasurement measured(const std::string& text) {
  written("shape_scene.toml", kScene);
  write_exr(scratch_path("shape_photo.exr"), picture());
  return read_scene_fit(read_scene_measurement(written("shape.toml", text)));
}

const FittedParameter& parameter(const SceneFit& fit, const std::string& name) {
  for (const FittedParameter& p : fit.parameters)
    if (p.name == name) return p;
  throw std::out_of_range(name + " in " + fit.full());
}

TEST(SceneMeasurement, FindsACameraThatIsNotWhereTheFileHasIt) {
  SceneMeasurement m = measured(std::string(kMeasurement) +
                                "[cameras.front]\npose = { fit = \"free\" }\n"
                                "focal_length = { fit = \"prior\", u_mm = 0.5 }\n");
  const SceneFit fit = fit_measurement(m, {});
  ASSERT_EQ(fit.summary.outcome, Outcome::converged) << fit.full();
  const std::map<std::string, double> truth = {{"camera front, right", 6.0},
                                               {"camera front, focal length", 35.35},
                                               {"camera front, roll", 0.0},
                                               {"camera front, pan", 0.0}};
  for (const auto& [name, value] : truth) {
    const FittedParameter& p = parameter(fit, name);
    // Three u, enlarged by nothing else; and the start was many u off where it was off.
    EXPECT_NEAR(p.estimate.value, value, 3.0 * p.estimate.standard_uncertainty) << fit.full();
  }
  EXPECT_NEAR(parameter(fit, "reflectance grey, 450 nm").estimate.value, 0.6, 0.01);
  // Held in the scene's place the same edges say that something is wrong.
  SceneMeasurement held = measured(std::string(kMeasurement) + "[cameras.front]\n");
  const SceneFit wrong = fit_measurement(held, {});
  EXPECT_GT(wrong.summary.chi2_per_dof, 2.0 * fit.summary.chi2_per_dof);
}

TEST(SceneMeasurement, ReadsAMosaicPhotositeByPhotosite) {
  // The mosaic keeps of each pixel the band of its photosite: nothing is interpolated.
  const Image& full = picture();
  Image mosaic(full.width, full.height);
  auto& value = mosaic.add_channel("value", 0.0f).samples;
  const BayerPattern pattern("rggb");
  for (int y = 0; y < full.height; ++y)
    for (int x = 0; x < full.width; ++x) {
      const std::size_t i = full.index(x, y);
      value[i] = full.channels[pattern.site(x, y) == 'R' ? 1 : 0].samples[i];
    }
  written("shape_scene.toml", kScene);
  write_exr(scratch_path("shape_mosaic.exr"), mosaic);
  std::string text = kMeasurement;
  text.replace(text.find("shape_photo"), 11, "shape_mosaic");
  const std::string planes =
      "bayer = \"rggb\"\n"
      "planes = [{ channel = \"value\", name = \"G\", photosites = \"G\", band_nm = 450 },\n"
      "{ channel = \"value\", name = \"R\", photosites = \"R\", band_nm = 600 }]\n";
  text.insert(text.find("[reflectances.grey]"), planes);
  text +=
      "[cameras.front]\npose = { fit = \"free\" }\nfocal_length = { fit = \"prior\", u_mm = 0.5 "
      "}\n";
  SceneMeasurement m = read_scene_fit(read_scene_measurement(written("shape.toml", text)));
  ASSERT_EQ(m.problem.planes.size(), 2u);
  EXPECT_NE(m.problem.planes[0].view, m.problem.planes[1].view);
  for (const ViewBlock& block : m.model().blocks())
    for (const std::uint32_t i : block.pixels)
      ASSERT_EQ(pattern.site(static_cast<int>(i) % 96, static_cast<int>(i) / 96),
                block.view == 0 ? 'G' : 'R');
  EXPECT_NEAR(static_cast<double>(m.counts[0].used) / static_cast<double>(m.counts[1].used), 2.0,
              0.1);
  const SceneFit fit = fit_measurement(m, {});
  ASSERT_EQ(fit.summary.outcome, Outcome::converged) << fit.full();
  for (const char* name : {"camera front, right", "camera front, pan"}) {
    const FittedParameter& p = parameter(fit, name);
    EXPECT_NEAR(p.estimate.value, name == std::string("camera front, right") ? 6.0 : 0.0,
                3.0 * p.estimate.standard_uncertainty);
  }
  EXPECT_NEAR(parameter(fit, "reflectance red, 600 nm").estimate.value, 0.5, 0.02) << fit.full();
}

void expect_refused(const std::string& more, const std::string& expected) {
  write_exr(scratch_path("shape_photo.exr"), picture());
  written("shape_scene.toml", kScene);
  const std::string path = written("shape_bad.toml", kMeasurement + more);
  try {
    read_scene_fit(read_scene_measurement(path));
    FAIL() << more;
  } catch (const InputError& error) {
    EXPECT_GE(error.line(), 21) << error.what();
    EXPECT_THAT(error.what(), HasSubstr(expected));
  }
}

TEST(SceneMeasurement, NamesAMistakeInWhatIsUnknown) {
  expect_refused("[cameras.back]\npose = { fit = \"free\" }\n", "a camera of the scene");
  expect_refused("[cameras.front]\npose = { fit = \"prior\", u_rad = 0.1 }\n", "u_mm");
  expect_refused("[cameras.front]\nfocal = { fit = \"free\" }\n", "focal");
  expect_refused("[cameras.front]\ndistortion = { fit = \"free\", terms = [\"k9\"] }\n", "k9");
  expect_refused("[[offsets]]\nname = \"a\"\nsurfaces = [\"cube*\"]\nmove = [1, 0, 0]\n",
                 "names of surfaces");
  expect_refused("[[offsets]]\nname = \"a\"\nsurfaces = [\"side\"]\n", "either move or stretch");
  expect_refused("[[offsets]]\nname = \"a\"\nsurfaces = [\"side\"]\nmove = [1, 0]\n",
                 "a list of 3 numbers");
}

TEST(SceneMeasurement, FindsAPanelThatStandsElsewhere) {
  std::string shifted = kScene;
  const std::string was = "[[250, 800, 300], [550, 800, 300], [550, 800, 700], [250, 800, 700]]",
                    is = "[[256, 800, 300], [556, 800, 300], [556, 800, 700], [256, 800, 700]]";
  shifted.replace(shifted.find(was), was.size(), is);
  const Scene scene = read_scene(written("shape_shifted.toml", shifted));
  PredictOptions options;
  options.elements = 1500;
  const Prediction prediction(scene, options);
  written("shape_scene.toml", kScene);
  write_exr(scratch_path("shape_photo.exr"),
            render(prediction, Camera(scene.cameras.at("front")), RenderOptions{}).radiance);
  std::string text = kMeasurement;  // 8 px would be 0.17 m: more than half shadows are wide
  text.replace(text.find("elements = 400"), 14, "elements = 800\ntile_px = 4");
  SceneMeasurement m = read_scene_fit(read_scene_measurement(
      written("shape.toml", text + "[[offsets]]\nname = \"panel\"\nsurfaces = [\"pan*\"]\n"
                                   "move = [1, 0, 0]\nfit = \"prior\"\nu_mm = 20\n")));
  const SceneFit fit = fit_measurement(m, {});
  ASSERT_EQ(fit.summary.outcome, Outcome::converged) << fit.full();
  const FittedParameter& p = parameter(fit, "offset panel");
  EXPECT_NEAR(p.estimate.value, 6.0, 3.0 * p.estimate.standard_uncertainty) << fit.full();
  EXPECT_LT(p.estimate.standard_uncertainty, 1.5);
}

}  // namespace
}  // namespace truebox

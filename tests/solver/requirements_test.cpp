// SPDX-License-Identifier: BSD-3-Clause
#include "scene/requirements.h"

#include <gmock/gmock.h>

#include "radiometry/input_error.h"
#include "scene/scene_file.h"
#include "support/tiny_scenes.h"
#include "transport/prediction.h"

namespace truebox {
namespace {

using testing::ElementsAre;

TEST(Requirements, AConvexGreyCubeNeedsOneBandAndNoOcclusion) {
  Scene cube = tiny::cube(1.0, 0.5, 1.0);
  cube.bands = WavelengthGrid::uniform(400, 700, 50);
  cube.materials[0].reflectance = Reflectance(7, 0.5);
  cube.materials[0].exitance = RadiantExitance(std::vector<double>{1, 2, 3, 4, 5, 6, 0.5});
  const Requirements needs = requirements(cube);
  EXPECT_FALSE(needs.occlusion);
  EXPECT_TRUE(needs.interreflection);
  EXPECT_THAT(needs.distinct_bands, ElementsAre(0u));
  EXPECT_THAT(needs.band_scale, ElementsAre(1, 2, 3, 4, 5, 6, 0.5));
  EXPECT_GE(needs.reasons.size(), 3u);
}

TEST(Requirements, AnotherReflectanceIsAnotherBand) {
  Scene cube = tiny::cube(1.0, 0.5, 1.0);
  cube.bands = WavelengthGrid::uniform(400, 500, 50);
  cube.materials[0].reflectance = Reflectance(std::vector<double>{0.5, 0.5000001, 0.5});
  cube.materials[0].exitance = RadiantExitance(3, 1.0);
  EXPECT_THAT(requirements(cube).distinct_bands, ElementsAre(0u, 1u));
  EXPECT_THAT(requirements(cube).band_source, ElementsAre(0u, 1u, 0u));
}

TEST(Requirements, DisproportionateLampsAreAnotherBand) {
  Scene cube = tiny::cube(1.0, 0.5, 1.0);
  cube.bands = WavelengthGrid::uniform(400, 450, 50);
  cube.materials = {{"a", Reflectance(2, 0.5), RadiantExitance(std::vector<double>{1, 2})},
                    {"b", Reflectance(2, 0.5), RadiantExitance(std::vector<double>{1, 3})}};
  cube.surfaces[0].material = 1;
  EXPECT_EQ(requirements(cube).distinct_bands.size(), 2u);
}

TEST(Requirements, APlaneNeedsNeither) {
  Scene plane = tiny::grey_scene(0.5, 1.0);
  tiny::add_surface(plane, "floor", {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
  EXPECT_FALSE(requirements(plane).interreflection);
  EXPECT_FALSE(requirements(plane).occlusion);
}

TEST(Requirements, BlackWallsNeedNoInterreflection) {
  EXPECT_FALSE(requirements(tiny::cube(1.0, 0.0, 1.0)).interreflection);
}

TEST(Requirements, ABlockNeedsOcclusion) {
  EXPECT_TRUE(requirements(tiny::cube_with_block(1.0, 0.5)).occlusion);
}

TEST(Requirements, TheCornellBoxNeedsBoth) {
  const Requirements needs = requirements(
      read_scene(std::string(TRUEBOX_REFERENCE_DIR) + "/cornell_box/cornell_box.toml"));
  EXPECT_TRUE(needs.occlusion);
  EXPECT_TRUE(needs.interreflection);
  EXPECT_EQ(needs.distinct_bands.size(), 76u);
}

TEST(Requirements, AMirrorNeedsPathTracingAndRadiosityRefusesIt) {
  Scene scene = tiny::cube_with_block(1.0, 0.5);
  EXPECT_FALSE(requirements(scene).path_tracing);
  EXPECT_NO_THROW(require_lambertian(scene));
  scene.materials.push_back({"silver", Reflectance(1, 0.9), RadiantExitance(1, 0.0)});
  scene.materials.back().scattering = Scattering::mirror;
  EXPECT_FALSE(requirements(scene).path_tracing) << "a material that nothing is made of";
  scene.surfaces[7].material = 1;
  EXPECT_TRUE(requirements(scene).path_tracing);
  EXPECT_THAT(requirements(scene).reasons, testing::Contains(testing::HasSubstr("path tracing")));
  try {
    const Prediction prediction(scene, {});
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("\"block 1\", a mirror"));
    EXPECT_THAT(error.what(), testing::HasSubstr("--method path"));
  }
}

TEST(Requirements, GlassOfAnotherIndexIsAnotherBand) {
  Scene cube = tiny::cube(1.0, 0.5, 1.0);
  cube.bands = WavelengthGrid::from_centres({450.0, 550.0});
  cube.materials = {{"a", Reflectance(2, 0.5), RadiantExitance(2, 1.0)},
                    {"glass", Reflectance(2, 0.0), RadiantExitance(2, 0.0)}};
  cube.materials[1].scattering = Scattering::dielectric;
  cube.materials[1].refractive_index = RefractiveIndex(std::vector<double>{1.52, 1.50});
  EXPECT_EQ(requirements(cube).distinct_bands.size(), 2u);
}

}  // namespace
}  // namespace truebox

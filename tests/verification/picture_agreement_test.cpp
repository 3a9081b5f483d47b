// SPDX-License-Identifier: BSD-3-Clause
#include "verification/picture_agreement.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include "image/image_file.h"
#include "image/spectral_image.h"
#include "path_tracer/path_tracer.h"
#include "radiometry/input_error.h"
#include "sensor/render.h"
#include "support/cornell_box.h"
#include "support/tiny_scenes.h"
#include "uncertainty/significance.h"

namespace truebox {
namespace {

constexpr double kFamilyLevel = 1e-3;  // chance of one family of tests to fail what agrees

TEST(Significance, ReproducesStudentsTables) {
  // Two-sided 5 % points; Abramowitz & Stegun (1964), table 26.10, and the normal's.
  EXPECT_NEAR(two_sided_p(12.706, 1), 0.05, 5e-6);
  EXPECT_NEAR(two_sided_p(4.303, 2), 0.05, 1e-5);
  EXPECT_NEAR(two_sided_p(2.776, 4), 0.05, 3e-5);
  EXPECT_NEAR(two_sided_p(2.131, 15), 0.05, 5e-5);
  EXPECT_NEAR(two_sided_p(2.042, 30), 0.05, 5e-5);
  EXPECT_NEAR(two_sided_p(1.959964), 0.05, 1e-7);
  EXPECT_NEAR(two_sided_p(1.96, 100000), two_sided_p(1.96), 5e-6);
  EXPECT_EQ(two_sided_p(0.0, 7), 1.0);
  EXPECT_EQ(two_sided_p(std::nan(""), 7), 0.0);
  EXPECT_NEAR(normal_score(two_sided_p(2.5)), 2.5, 1e-9);
  EXPECT_NEAR(family_wise_p(1e-6, 1000), 1e-3, 1e-6);
  EXPECT_EQ(family_wise_p(1.0, 10), 1.0);
}

struct Noisy {
  Image radiance{40, 32}, error{40, 32};
  explicit Noisy(double standard_error, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal(5.0, standard_error);
    for (double nm : {450.0, 550.0}) {
      for (float& v : radiance.add_channel(spectral_channel_name(nm)).samples)
        v = static_cast<float>(normal(random));
      error.add_channel(spectral_channel_name(nm), static_cast<float>(standard_error));
    }
  }
  UncertainPicture picture() const { return {&radiance, &error}; }
};

TEST(PictureAgreement, OfPureNoiseIsANormalDistribution) {
  const Noisy a(0.1, 1), b(0.2, 2);
  for (int block : {1, 4}) {
    const PictureAgreement agreement = picture_agreement(a.picture(), b.picture(), block);
    EXPECT_EQ(agreement.tests, 2u * 40 * 32 / (block * block));
    EXPECT_GT(agreement.family_wise_p, kFamilyLevel);
    // 4.5 standard errors of a mean and of a spread.
    EXPECT_LT(std::abs(agreement.mean_score), 4.5 / std::sqrt(agreement.tests));
    EXPECT_NEAR(agreement.rms_score, 1.0, 4.5 / std::sqrt(2.0 * agreement.tests));
  }
}

TEST(PictureAgreement, FindsAPlantedDifferenceAndItsPlace) {
  Noisy a(0.1, 1);
  const Noisy b(0.1, 2);
  const std::size_t planted = a.radiance.index(13, 7);
  a.radiance.channels[1].samples[planted] = b.radiance.channels[1].samples[planted] + 1.2f;
  const PictureAgreement agreement = picture_agreement(a.picture(), b.picture());
  EXPECT_LT(agreement.family_wise_p, 1e-10);
  EXPECT_EQ(agreement.p_values.channels[1].samples[planted],
            static_cast<float>(agreement.smallest_p));
  // A shift too small for any pixel shows in blocks.
  Noisy c(0.1, 3);
  for (float& v : c.radiance.channels[0].samples) v += 0.06f;
  EXPECT_LT(picture_agreement(c.picture(), b.picture(), 8).family_wise_p, kFamilyLevel);
}

TEST(PictureAgreement, ABoundExcusesWhatLiesWithinIt) {
  Noisy a(0.1, 1);
  const Noisy b(0.1, 2);
  for (float& v : a.radiance.channels[0].samples) v += 2.0f;
  Image bound = a.error;
  for (Channel& channel : bound.channels)
    for (float& v : channel.samples) v = 2.0f;
  EXPECT_LT(picture_agreement(a.picture(), b.picture()).family_wise_p, 1e-10);
  EXPECT_GT(picture_agreement({&a.radiance, nullptr, &bound}, b.picture()).family_wise_p,
            kFamilyLevel);
}

TEST(PictureAgreement, CountsWhatIsNotANumberAsDisagreement) {
  Noisy a(0.1, 1);
  const Noisy b(0.1, 2);
  a.radiance.channels[0].samples[5] = std::nanf("");
  EXPECT_EQ(picture_agreement(a.picture(), b.picture()).smallest_p, 0.0);
  EXPECT_THROW(picture_agreement(a.picture(), b.picture(), 3), MismatchError);
}

RayOfPixel rays_of(const Camera& camera) {
  return [&camera](int x, int y, UnitPair at) {
    const Ray ray = *camera.ray({x + at.u, y + at.v});
    return PixelRay{ray.origin_m, ray.direction};
  };
}

class ThreePictures : public testing::Test {
 protected:
  // Against the independent render, in blocks of 16 x 16 px, all bands.
  PictureAgreement paths_against_independent(const Scene& scene) const {
    const std::string folder = std::string(TRUEBOX_REFERENCE_DIR) + "/independent_renders/";
    const Image truth = read_image(folder + "cornell_box_front_256_7bands.exr");
    const Image error = read_image(folder + "cornell_box_front_256_7bands_stderr.exr");
    CameraDescription description = scene.cameras.at("front");
    description.pixels = {truth.width, truth.height};
    const Camera camera(description);
    PathTraceOptions options;
    options.samples = 64;
    const PathTracedImage image =
        trace_paths(scene, truth.width, truth.height, rays_of(camera), options);
    const Image noise = image.standard_error();
    const PictureAgreement a = picture_agreement(
        {&image.radiance, &noise, nullptr, image.randomisations - 1}, {&truth, &error}, 16);
    std::printf("%zu blocks, family-wise p %.3g, spread %.3f, bias %.4f %% or %.2f sigma\n",
                a.tests, a.family_wise_p, a.rms_score, 100.0 * a.bias, a.bias_score);
    return a;
  }
};

TEST_F(ThreePictures, PathsAgreeWithTheIndependentRender) {
  const PictureAgreement a = paths_against_independent(cornell_box_in_seven_bands());
  EXPECT_GT(a.tests, 1400u);
  EXPECT_GT(a.family_wise_p, kFamilyLevel);
  EXPECT_LT(std::abs(a.bias_score), 4.0);  // 4e-4 for the largest of seven
  // 4.5 standard errors of a spread; bands share their paths, so 256 blocks count.
  EXPECT_NEAR(a.rms_score, 1.0, 4.5 / std::sqrt(2.0 * 256.0));
}

TEST_F(ThreePictures, PathsDisagreeWhenOneReflectanceIsTwoPercentOff) {
  Scene planted = cornell_box_in_seven_bands();
  for (Material& material : planted.materials)
    if (material.name == "red")
      for (double& rho : material.reflectance.values) rho *= 1.02;
  EXPECT_LT(paths_against_independent(planted).family_wise_p, kFamilyLevel);
}

// Occlusion, a sheet lit on both sides, an opening, a lamp that reflects.
Scene furnished_room(double rho) {
  Scene scene = tiny::cube_with_block(1.0, rho);
  scene.materials.push_back({"(opening)", Reflectance(1, 0.0), RadiantExitance(1, 0.0)});
  scene.surfaces[2].material = 1;
  scene.surfaces[2].is_opening = true;  // y = 0: the camera looks in
  scene.surfaces[2].name = "opening";
  std::rotate(scene.surfaces.begin() + 2, scene.surfaces.begin() + 3, scene.surfaces.end());
  scene.materials.push_back({"lamp", Reflectance(1, 0.5), RadiantExitance(1, 1.0)});
  const Polygon sheet{{0.65, 0.4, 0.3}, {0.9, 0.4, 0.3}, {0.9, 0.8, 0.3}, {0.65, 0.8, 0.3}};
  scene.surfaces.insert(scene.surfaces.end() - 1,
                        {"sheet", 0, {sheet, Polygon(sheet.rbegin(), sheet.rend())}, false, true});
  scene.surfaces.insert(scene.surfaces.end() - 1,
                        {"lamp",
                         2,
                         {{{0.3, 0.3, 0.97}, {0.3, 0.7, 0.97}, {0.7, 0.7, 0.97}, {0.7, 0.3, 0.97}}},
                         false});
  return scene;
}

TEST_F(ThreePictures, RadiosityAndPathsAgreeOnALambertianRoom) {
  const Camera camera({.position_m = {0.5, -1.2, 0.5},
                       .direction = {0, 1, 0},
                       .up = {0, 0, 1},
                       .focal_length_m = 0.03,
                       .film_m = {0.025, 0.025},
                       .pixels = {48, 48}});
  const Scene scene = furnished_room(0.6), brighter = furnished_room(0.612);
  PredictOptions predict;
  predict.elements = 2500;
  const Prediction prediction(scene, predict);
  const RenderedImage radiosity = render(prediction, camera, {});
  PathTraceOptions options;
  options.samples = 512;
  for (const bool planted : {false, true}) {
    const PathTracedImage paths =
        trace_paths(planted ? brighter : scene, 48, 48, rays_of(camera), options);
    const Image noise = paths.standard_error();
    const UncertainPicture by_paths{&paths.radiance, &noise, nullptr, paths.randomisations - 1};
    const PictureAgreement with_bound =
        picture_agreement({&radiosity.radiance, nullptr, &radiosity.error_bound}, by_paths, 4);
    const PictureAgreement pixels = picture_agreement({&radiosity.radiance}, by_paths);
    std::printf("%s: blocks with bound p %.3g; pixels bias %.4f %%, spread %.3f\n",
                planted ? "planted" : "same", with_bound.family_wise_p, 100.0 * pixels.bias,
                pixels.rms_score);
    if (planted) {
      EXPECT_LT(with_bound.family_wise_p, kFamilyLevel) << "rho 2 % off";
    } else {
      EXPECT_GT(with_bound.family_wise_p, kFamilyLevel);
      EXPECT_LT(std::abs(pixels.bias), 2e-3);  // of the grid of 2500 elements
      EXPECT_NEAR(pixels.rms_score, 1.0, 0.1);
    }
  }
}

}  // namespace
}  // namespace truebox

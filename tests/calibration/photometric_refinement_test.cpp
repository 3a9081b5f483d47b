// SPDX-License-Identifier: BSD-3-Clause
#include "alignment/photometric_refinement.h"

#include <gmock/gmock.h>

#include <cstdlib>

#include "sensor/aovs.h"
#include "support/edge_picture.h"
#include "uncertainty/distributions.h"

namespace truebox {
namespace {

using testing::HasSubstr;

/// 0 to 1 over `width` about 0, as a penumbra.
double penumbra(double x, double width) {
  const double t = std::clamp(0.5 + x / width, 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

/// Walls with light that falls off and shadows that cross them.
double shadowed(int surface, const Vec3& p) {
  if (surface < 0) return even_shade(surface, p);
  const double fall = 0.7 + 0.1 * p[0] + 0.15 * p[1] - 0.1 * p[2];
  const double shadow = 0.45 + 0.55 * penumbra(std::sin(2.6 * p[0] + 1.1 * p[1] - 2.1 * p[2]), 0.3);
  return even_shade(surface, p) * fall * shadow;
}

CameraDescription lens_camera() {
  CameraDescription camera = test_camera(240, 200);
  camera.lens.distortion.k1 = -0.12;
  camera.lens.distortion.k2 = 0.05;
  return camera;
}

const Image& photograph() {
  static const Image kImage = edge_picture(test_box(), lens_camera(), shadowed, 0.0, 1);
  return kImage;
}

/// The same light, predicted for a camera half a degree and a few px off; its reading is another
/// unit's.
RenderedView predicted(const Shade& shade) {
  CameraDescription camera = lens_camera();
  camera.position_m += Vec3(0.01, -0.008, 0.015);
  camera.direction += Vec3(0.004, 0.003, 0.0);
  Image picture = edge_picture(
      test_box(), camera, [&](int s, const Vec3& p) { return 7.0 * shade(s, p); }, 0.0, 2, 64);
  return RenderedView(std::move(picture), camera, geometry_aovs(test_box(), Camera(camera)));
}

BoxAlignment from_edges(const Image& photo) {
  AlignmentOptions options;
  options.search = false;
  return align_box(test_box(), lens_camera(), photo, options);
}

struct Prediction {
  const char* name;
  Shade shade;
};

class IntervalsOfRefined : public testing::TestWithParam<Prediction> {};

// Predictions that are right, and such that err smoothly all over the picture: what the light adds
// makes the camera better, and intervals hold the truth as often as they say.
TEST_P(IntervalsOfRefined, CoverTheTruthAndAreCloserThanThoseOfEdgesAlone) {
  const char* asked = std::getenv("TRUEBOX_TRIALS");
  const auto trials = static_cast<std::size_t>(asked ? std::atoi(asked) : 4);
  const RenderedView view = predicted(GetParam().shade);
  PhotometricOptions options;
  if (!asked) options.most_samples = 8000;
  double edges2 = 0.0, light2 = 0.0, stated = 0.0, dispersion = 0.0;
  std::size_t misses = 0, edge_misses = 0, checks = 0;
  for (std::size_t i = 0; i < trials; ++i) {
    const Image photo = noisy(photograph(), 0.02, 100 + i);
    const BoxAlignment edges = from_edges(photo);
    ASSERT_EQ(edges.outcome, AlignmentOutcome::converged) << edges.message;
    const PhotometricRefinement found = refine_by_radiance(edges, view, photo, options);
    ASSERT_EQ(found.outcome, AlignmentOutcome::converged) << found.message;
    edges2 +=
        std::pow(corner_error_px(test_box(), lens_camera(), edges.camera), 2) / double(trials);
    light2 +=
        std::pow(corner_error_px(test_box(), lens_camera(), found.camera), 2) / double(trials);
    stated += found.refined_u_px / found.edge_u_px / double(trials);
    dispersion += found.dispersion / double(trials);
    const auto exact = values_of(camera_parameters(lens_camera(), found.parameters.centre_m));
    for (std::size_t k = 0; k < found.estimated.size(); ++k) {
      // Pose, focal length, principal point, k1 and k2 are the first of all.
      const auto missed = [&](const EstimatedParameter& p) {
        return std::abs(p.value - exact[k]) > 1.96 * p.standard_uncertainty;
      };
      misses += missed(found.estimated[k]);
      edge_misses += missed(edges.estimated[k]);
      ++checks;
    }
  }
  std::printf(
      "corners %.4f px by edges, %.4f px with light; u ratio %.2f, dispersion %.2f, covered %.1f "
      "%% (edges %.1f %%)\n",
      std::sqrt(edges2), std::sqrt(light2), stated, dispersion,
      100.0 - 100.0 * double(misses) / double(checks),
      100.0 - 100.0 * double(edge_misses) / double(checks));
  EXPECT_LT(light2, edges2);
  EXPECT_LT(stated, 1.0);
  // The parameters of one picture move together: pictures count, not parameters.
  const auto per_picture = static_cast<std::size_t>(std::lround(double(misses) / 11.0));
  EXPECT_GT(binomial_upper_tail(per_picture, trials, 0.07), 1e-3) << misses << " of " << checks;
}

/// Light that falls off otherwise than predicted: by 8 % from one side to the other.
double tilted(int surface, const Vec3& p) {
  return shadowed(surface, p) * (surface < 0 ? 1.0 : 1.0 + 0.04 * p[0] - 0.03 * p[1]);
}

INSTANTIATE_TEST_SUITE_P(RefineByRadiance, IntervalsOfRefined,
                         testing::Values(Prediction{"right", shadowed},
                                         Prediction{"tilted", tilted}),
                         [](const auto& p) { return std::string(p.param.name); });

// The lamp stands elsewhere than the scene says, so that every shadow does: a camera that followed
// the shadows would leave the edges.
TEST(RefineByRadiance, DoesNotLeaveGoodEdgesForAWrongPredictionWithoutSayingSo) {
  PhotometricOptions options;
  options.most_samples = 8000;
  const Image photo = noisy(photograph(), 0.01, 7);
  const BoxAlignment edges = from_edges(photo);
  ASSERT_EQ(edges.outcome, AlignmentOutcome::converged) << edges.message;
  const RenderedView view =
      predicted([](int s, const Vec3& p) { return shadowed(s, p + Vec3(0.04, 0.0, 0.0)); });
  const PhotometricRefinement found = refine_by_radiance(edges, view, photo, options);
  std::printf("shadows off by 4 cm: %s, p %.2g, dispersion %.1f\n",
              to_string(found.outcome).c_str(), found.p_value, found.dispersion);
  EXPECT_EQ(found.outcome, AlignmentOutcome::contradiction);
  EXPECT_EQ(values_of(found.parameters), values_of(edges.parameters));
  EXPECT_THAT(found.message, HasSubstr("the camera of the edges is kept"));
}

TEST(RefineByRadiance, SaysWhereThereIsTooLittleToCompare) {
  const Image photo = noisy(photograph(), 0.01, 8);
  const BoxAlignment edges = from_edges(photo);
  const RenderedView view = predicted(shadowed);
  Image mask(photo.width, photo.height);
  mask.add_channel("Y", 0.0f);
  for (int x = 100; x < 110; ++x) mask.channels[0].samples[mask.index(x, 150)] = 1.0f;
  PhotometricOptions options;
  options.mask = &mask;
  const PhotometricRefinement found = refine_by_radiance(edges, view, photo, options);
  EXPECT_EQ(found.outcome, AlignmentOutcome::invalid_problem);
  EXPECT_THAT(found.message, HasSubstr("pixels"));
  EXPECT_EQ(values_of(found.parameters), values_of(edges.parameters));
  // A picture of nothing has no edges; their outcome is handed on.
  BoxAlignment none = edges;
  none.outcome = AlignmentOutcome::no_such_box;
  EXPECT_EQ(refine_by_radiance(none, view, photo, {}).outcome, AlignmentOutcome::no_such_box);
}

// A photograph of one tone curve or of painted walls: what a gain for each surface takes up.
TEST(RefineByRadiance, GainsOfEachSurfaceTakeUpWrongReflectances) {
  const Shade painted = [](int s, const Vec3& p) {
    return shadowed(s, p) * (s >= 0 && s % 2 ? 0.7 : 1.1);
  };
  const Image photo = noisy(photograph(), 0.02, 9);
  const BoxAlignment edges = from_edges(photo);
  ASSERT_EQ(edges.outcome, AlignmentOutcome::converged);
  PhotometricOptions options;
  options.most_samples = 8000;
  options.gain_per_surface = true;
  const PhotometricRefinement found = refine_by_radiance(edges, predicted(painted), photo, options);
  ASSERT_EQ(found.outcome, AlignmentOutcome::converged) << found.message;
  EXPECT_LT(corner_error_px(test_box(), lens_camera(), found.camera), 0.1);
  double ceiling = 0.0, back = 0.0;  // surfaces 1 and 2
  for (const BandGain& g : found.bands) {
    if (g.surface == "ceiling") ceiling = g.gain;
    if (g.surface == "back") back = g.gain;
  }
  EXPECT_NEAR(ceiling / back, 1.1 / 0.7, 0.05);
}

}  // namespace
}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <cstdio>

#include "image/image_file.h"
#include "sensor/render.h"
#include "support/cornell_box.h"
#include "verification/render_agreement.h"

namespace truebox {
namespace {

// Share of pixel-bands outside own bound + 3 standard errors. A normal distribution leaves 0.27 %;
// the reference's standard errors come from 1024 paths each, with heavy tails in dark pixels.
constexpr double kShareOutside = 0.006;
constexpr double kMeanZ = 0.3;       // standard errors: a bias of all pixels together
constexpr double kRmsZ = 1.25;       // 1 for pure reference noise, own error adds in quadrature
constexpr double kMeanBound = 0.01;  // of the mean radiance: a bound that says something

class IndependentRender : public testing::Test {
 protected:
  RenderAgreement agreement_of(const Scene& scene) const {
    const Prediction prediction(scene, {});
    EXPECT_EQ(prediction.outcome(), SolveOutcome::converged);
    CameraDescription camera = scene.cameras.at("front");
    camera.pixels = {256, 256};
    const RenderedImage image = render(prediction, Camera(camera), {});
    const RenderAgreement a = render_agreement(image.radiance, image.error_bound, truth_, error_);
    std::printf(
        "%zu pixel-bands, outside %.3f %%, mean z %.3f, rms z %.3f, mean bound %.2f %%, bias %.3f "
        "%%\n",
        a.samples, 100.0 * a.share_outside(), a.mean_z, a.rms_z, 100.0 * a.mean_bound,
        100.0 * a.bias);
    return a;
  }
  static bool agrees(const RenderAgreement& a) {
    return a.samples > 300000 && a.share_outside() <= kShareOutside &&
           std::abs(a.mean_z) <= kMeanZ && a.rms_z < kRmsZ && a.mean_bound < kMeanBound;
  }

  const std::string folder_ = std::string(TRUEBOX_REFERENCE_DIR) + "/independent_renders/";
  const Image truth_ = read_image(folder_ + "cornell_box_front_256_7bands.exr");
  const Image error_ = read_image(folder_ + "cornell_box_front_256_7bands_stderr.exr");
};

TEST_F(IndependentRender, AgreesInEveryBand) {
  const RenderAgreement a = agreement_of(cornell_box_in_seven_bands());
  EXPECT_GT(a.samples, 300000u);
  EXPECT_LE(a.share_outside(), kShareOutside);
  EXPECT_LE(std::abs(a.mean_z), kMeanZ);
  EXPECT_LT(a.rms_z, kRmsZ);
  EXPECT_LT(a.mean_bound, kMeanBound);
}

TEST_F(IndependentRender, DisagreesWhenOneReflectanceIsTwoPercentOff) {
  Scene planted = cornell_box_in_seven_bands();
  // The red paint is on the left wall alone: two triangles, a fifth of the picture.
  for (Material& material : planted.materials)
    if (material.name == "red")
      for (double& rho : material.reflectance.values) rho *= 1.02;
  EXPECT_FALSE(agrees(agreement_of(planted)));
}

}  // namespace
}  // namespace truebox

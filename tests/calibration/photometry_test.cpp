// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "photometry/camera_response.h"
#include "photometry/master_dark.h"
#include "photometry/noise_model.h"
#include "radiometry/input_error.h"

namespace truebox {
namespace {

const std::vector<double> kExposures_s = {0.025, 0.05, 0.1, 0.25, 0.5};

CameraResponse response(double offset_dn, double curvature_per_dn) {
  CameraResponse r;
  r.offset_dn.value = offset_dn;
  r.curvature_per_dn.value = curvature_per_dn;
  return r;
}

std::vector<ExposureSeries> series_of(const CameraResponse& truth) {
  std::vector<ExposureSeries> series;
  for (double rate = 20.0; rate < 480.0; rate *= 1.3) {
    series.push_back({kExposures_s, {}});
    for (double t : kExposures_s) series.back().readings_dn.push_back(truth.reading_dn(rate * t));
  }
  return series;
}

TEST(CameraResponse, LinearisingInvertsTheReading) {
  const CameraResponse r = response(-0.4, 1.3e-4);
  for (double x : {0.0, 1.0, 50.0, 240.0})
    EXPECT_NEAR(r.linear_dn(r.reading_dn(x)), x, 1e-9) << x;  // DN: cancellation in the root
}

TEST(CameraResponse, IsRecoveredFromExposureSeries) {
  for (const double curvature : {-5e-5, 0.0, 1.5e-4}) {
    const auto estimate = estimate_response(series_of(response(-0.3, curvature))).response;
    EXPECT_NEAR(estimate.offset_dn.value, -0.3, 1e-6);  // DN: converged Gauss-Newton
    EXPECT_NEAR(estimate.curvature_per_dn.value, curvature, 1e-9);
  }
}

TEST(CameraResponse, StaysLinearWithoutEnoughSeries) {
  auto series = series_of(response(-0.3, 1.5e-4));
  series.resize(2);
  const auto estimate = estimate_response(series).response;
  EXPECT_EQ(estimate.offset_dn.value, 0.0);
  EXPECT_EQ(estimate.curvature_per_dn.value, 0.0);
}

TEST(NoiseModel, FindsGainAndFloorOfASimulatedSensor) {
  // Seed 20261. 24 levels of 4000 second differences: the variance of each is known to
  // sqrt(2 x 35/18 / 4000) = 3.1 % (neighbouring differences share readings); the slope to 1 %.
  std::mt19937 random(20261);
  const double gain = 0.05, floor = 0.5;
  std::vector<NoiseSample> samples;
  for (int level = 0; level < 24; ++level) {
    const double mean = 5.0 + 8.0 * level;
    std::normal_distribution<double> noise(0.0, std::sqrt(floor + gain * mean));
    Frame frame;
    frame.image = Image(204, 20);
    auto& y = frame.image.add_channel("Y").samples;
    for (float& v : y) v = static_cast<float>(mean + noise(random));
    const std::vector<std::uint8_t> labels(y.size(), 1);
    for (const auto& s : second_difference_noise(frame, BayerPattern("gbrg"), labels, 1, 1e9))
      samples.push_back(s);
  }
  const NoiseModel model = estimate_noise(samples);
  EXPECT_NEAR(model.gain_dn, gain, 0.05 * gain);  // 5 sigma of the slope
  EXPECT_NEAR(model.floor_dn2, floor, 0.25);      // DN^2, 5 sigma of the intercept
}

TEST(NoiseModel, ShadingIsNotNoise) {
  Frame frame;
  frame.image = Image(64, 16);
  auto& y = frame.image.add_channel("Y").samples;
  for (int row = 0; row < 16; ++row)
    for (int x = 0; x < 64; ++x) y[frame.image.index(x, row)] = static_cast<float>(50 + x + row);
  const std::vector<std::uint8_t> labels(y.size(), 1);
  const auto samples = second_difference_noise(frame, BayerPattern("gbrg"), labels, 1, 255.0);
  ASSERT_EQ(samples.size(), 4u);
  for (const auto& s : samples) EXPECT_EQ(s.variance_dn2, 0.0);
}

TEST(NoiseModel, NeverGoesBelowQuantisation) {
  const NoiseModel model = estimate_noise({{10.0, 0.0, 100}, {100.0, 0.0, 100}});
  EXPECT_EQ(model.floor_dn2, kQuantisationVariance_dn2);
  EXPECT_EQ(model.gain_dn, 0.0);
}

Frame dark_frame(float a, float b, int width = 2) {
  Frame frame{.path = "dark", .exposure_s = 1.0, .image = Image(width, 1)};
  frame.image.add_channel("Y").samples = {a, b};
  return frame;
}

TEST(MasterDark, IsTheMeanWithTheVarianceOfTheMean) {
  const MasterDark dark = mean_dark({dark_frame(4, 0), dark_frame(8, 0)});
  EXPECT_EQ(dark.mean_dn[0], 6.0f);
  EXPECT_EQ(dark.mean_dn[1], 0.0f);
  // Sample variances 8 and 0, pooled 4, of a mean of two: 2.
  EXPECT_NEAR(dark.variance_dn2, 2.0, 1e-12);
  EXPECT_EQ(dark.clipped_fraction, 0.5);
  EXPECT_NEAR(mean_dark({dark_frame(1, 1)}).variance_dn2, kQuantisationVariance_dn2, 1e-15);
}

TEST(MasterDark, IsMatchedByExposure) {
  const std::vector<MasterDark> darks = {mean_dark({dark_frame(1, 1)})};
  EXPECT_EQ(matching_dark(darks, 1.0), &darks[0]);
  EXPECT_EQ(matching_dark(darks, 1.5), nullptr);
}

TEST(MasterDark, RefusesFramesOfOtherSizes) {
  Frame other = dark_frame(1, 1);
  other.image = Image(1, 1);
  other.image.add_channel("Y");
  EXPECT_THROW(mean_dark({dark_frame(1, 1), other}), MismatchError);
}

}  // namespace
}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "photometry/exposure_merge.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "radiometry/input_error.h"

namespace truebox {
namespace {

const std::vector<double> kExposures_s = {0.025, 0.1, 0.5, 2.0};

Frame frame_of(double exposure_s, const std::vector<double>& readings) {
  Frame frame;
  frame.exposure_s = exposure_s;
  frame.image = Image(static_cast<int>(readings.size()), 1);
  auto& y = frame.image.add_channel("Y").samples;
  std::transform(readings.begin(), readings.end(), y.begin(),
                 [](double v) { return static_cast<float>(v); });
  return frame;
}

MergeOptions sensor() {
  MergeOptions options;
  options.saturation_dn = 250.0;
  options.floor_dn = 0.0;
  options.noise = {.floor_dn2 = 1.5, .gain_dn = 0.02};
  return options;
}

/// Frames of `pixels` photosites of one rate, normal noise of the model, clipped at 255 DN.
std::vector<Frame> simulated(double rate, std::size_t pixels, const MergeOptions& options,
                             std::mt19937& random) {
  std::vector<Frame> frames;
  for (double t : kExposures_s) {
    std::vector<double> readings;
    std::normal_distribution<double> noise(0.0, std::sqrt(options.noise.variance_dn2(rate * t)));
    for (std::size_t i = 0; i < pixels; ++i)
      readings.push_back(std::min(255.0, options.response.reading_dn(rate * t) + noise(random)));
    frames.push_back(frame_of(t, readings));
  }
  return frames;
}

TEST(ExposureMerge, IsExactWithoutNoise) {
  std::vector<Frame> frames;
  for (double t : kExposures_s) frames.push_back(frame_of(t, {40.0 * t, 90.0 * t}));
  const auto photograph = merge_exposures(frames, {}, BayerPattern(), sensor()).photograph;
  EXPECT_NEAR(photograph.value[0], 40.0, 40.0 * 1e-6);  // DN/s: stored as float
  EXPECT_NEAR(photograph.value[1], 90.0, 90.0 * 1e-6);
  EXPECT_EQ(photograph.exposures_used[0], 4);
}

TEST(ExposureMerge, WeightsAreThoseOfMinimumVariance) {
  // Constant variance v: w = t^2 / v, so var(r) = v / sum t^2.
  MergeOptions options = sensor();
  options.noise = {.floor_dn2 = 2.0, .gain_dn = 0.0};
  std::vector<Frame> frames;
  double sum = 0.0;
  for (double t : kExposures_s) {
    frames.push_back(frame_of(t, {50.0 * t}));
    sum += t * t;
  }
  const auto photograph = merge_exposures(frames, {}, BayerPattern(), options).photograph;
  EXPECT_NEAR(photograph.variance[0], 2.0 / sum, 1e-6 * 2.0 / sum);
}

TEST(ExposureMerge, PredictsItsScatter) {
  // Seed 20262, 20000 photosites a rate: the mean square deviation over the predicted variance is
  // 1 with a standard deviation of sqrt(2 / 20000) = 0.01; [0.95, 1.05] is 5 sigma, a false alarm
  // in 2e6 runs. The mean deviates by less than 5 of its sigmas.
  std::mt19937 random(20262);
  for (double rate : {30.0, 300.0, 3000.0}) {
    const std::size_t pixels = 20000;
    const MergeOptions options = sensor();
    const auto result =
        merge_exposures(simulated(rate, pixels, options, random), {}, BayerPattern(), options);
    double mean = 0.0, chi2 = 0.0, sigma2 = 0.0;
    for (std::size_t i = 0; i < pixels; ++i) {
      const double d = result.photograph.value[i] - rate, v = result.photograph.variance[i];
      mean += d / static_cast<double>(pixels);
      chi2 += d * d / v / static_cast<double>(pixels);
      sigma2 += v / static_cast<double>(pixels);
    }
    EXPECT_NEAR(chi2, 1.0, 0.05) << rate;
    EXPECT_LT(std::abs(mean), 5.0 * std::sqrt(sigma2 / static_cast<double>(pixels))) << rate;
    if (result.dof > 0) {
      EXPECT_NEAR(result.chi2_per_dof, 1.0, 0.05) << rate;
    }
  }
}

TEST(ExposureMerge, ASaturatedExposureNeverBiases) {
  // Rates whose longest usable exposure ends just below, at and just above saturation. The reading
  // of that exposure must not pull the mean down: 5 sigma of the mean of 20000. Seed 20263.
  std::mt19937 random(20263);
  const MergeOptions options = sensor();
  for (double top_dn : {235.0, 244.0, 249.0, 251.0, 254.0, 260.0, 400.0}) {
    const double rate = top_dn / kExposures_s.back();
    const std::size_t pixels = 20000;
    const auto photograph =
        merge_exposures(simulated(rate, pixels, options, random), {}, BayerPattern(), options)
            .photograph;
    double mean = 0.0, sigma2 = 0.0;
    for (std::size_t i = 0; i < pixels; ++i) {
      mean += photograph.value[i] / static_cast<double>(pixels);
      sigma2 += photograph.variance[i] / static_cast<double>(pixels);
    }
    EXPECT_LT(std::abs(mean - rate), 5.0 * std::sqrt(sigma2 / static_cast<double>(pixels)))
        << top_dn;
  }
}

TEST(ExposureMerge, SaturatedEverywhereIsUnknownNotWrong) {
  std::vector<Frame> frames;
  for (double t : kExposures_s) frames.push_back(frame_of(t, {255.0}));
  const auto photograph = merge_exposures(frames, {}, BayerPattern(), sensor()).photograph;
  EXPECT_EQ(photograph.exposures_used[0], 0);
  EXPECT_TRUE(std::isinf(photograph.variance[0]));
}

TEST(ExposureMerge, BelowTheFloorEverywhereIsABoundWithItsUncertainty) {
  MergeOptions options = sensor();
  options.floor_dn = 2.0;
  std::vector<Frame> frames;
  for (double t : kExposures_s) frames.push_back(frame_of(t, {0.0}));
  const auto photograph = merge_exposures(frames, {}, BayerPattern(), options).photograph;
  EXPECT_EQ(photograph.exposures_used[0], 0);
  EXPECT_EQ(photograph.value[0], 0.0f);
  const double t = kExposures_s.back();
  EXPECT_NEAR(photograph.variance[0], (1.5 + 1.0 / 3.0) / (t * t), 1e-6);
}

TEST(ExposureMerge, SubtractsTheDarkAndCarriesItsVariance) {
  MergeOptions options = sensor();
  options.noise = {.floor_dn2 = 2.0, .gain_dn = 0.0};
  const std::vector<Frame> dark_frames = {frame_of(2.0, {10.0}), frame_of(2.0, {14.0})};
  const std::vector<MasterDark> darks = {mean_dark(dark_frames)};
  const auto photograph =
      merge_exposures({frame_of(2.0, {112.0})}, darks, BayerPattern(), options).photograph;
  EXPECT_NEAR(photograph.value[0], 50.0, 1e-5);
  // Dark: sample variance 8 of two, mean 4. (2 + 4) / t^2.
  EXPECT_NEAR(photograph.variance[0], 6.0 / 4.0, 1e-6);
}

TEST(ExposureMerge, RefusesFramesOfOtherSizes) {
  EXPECT_THROW(merge_exposures({frame_of(1.0, {1.0}), frame_of(2.0, {1.0, 2.0})}, {},
                               BayerPattern(), sensor()),
               MismatchError);
  EXPECT_THROW(merge_exposures({}, {}, BayerPattern(), sensor()), std::invalid_argument);
}

}  // namespace
}  // namespace truebox

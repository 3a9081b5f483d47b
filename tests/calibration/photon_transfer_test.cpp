// SPDX-License-Identifier: BSD-3-Clause
#include "photometry/photon_transfer.h"

#include <gmock/gmock.h>

#include "calibration/simulated_frames.h"
#include "photometry/dark_distribution.h"
#include "radiometry/input_error.h"

namespace truebox {
namespace {

BlockOptions plain() {
  BlockOptions options;
  options.saturation_dn = 1e9;
  options.mosaic = false;
  return options;
}

// 200 sets of three exposures of a textured scene, seed 7. Each fit must cover the truth: of 200
// intervals of 2 u, 95.4 % hold it in the mean; fewer than 180 has a probability below 1e-3. The
// mean square of the normalised error is 1 +- 0.1 (chi^2 of 200 degrees of freedom) if u is right;
// pairs that share a frame make u an upper bound, so the lower limit is looser.
TEST(PhotonTransfer, CoversGainAndFloorOfSimulatedSensors) {
  const SimulatedSensor sensor{.gain_dn = 0.05, .read_noise_dn = 0.6};
  const double floor = 0.6 * 0.6 + kQuantisationVariance_dn2;
  std::mt19937_64 random(7);
  int covered_gain = 0, covered_floor = 0;
  double z2_gain = 0.0, z2_floor = 0.0;
  constexpr int kSets = 200;
  for (unsigned set = 0; set < kSets; ++set) {
    const auto scene = textured_scene(64, 64, 2000.0, set);
    std::vector<Frame> frames;
    for (double t : {0.25, 0.5, 2.0})
      frames.push_back(simulated_frame(scene, 64, t, sensor, random));
    const PhotonTransfer fit = fit_photon_transfer(pair_samples(frames, 0, plain()));
    ASSERT_TRUE(fit.found) << fit.why_not;
    const double zg = (fit.model.gain_dn - sensor.gain_dn) / fit.gain_u_dn;
    const double zf = (fit.model.floor_dn2 - floor) / fit.floor_u_dn2;
    covered_gain += std::abs(zg) < 2.0;
    covered_floor += std::abs(zf) < 2.0;
    z2_gain += zg * zg / kSets;
    z2_floor += zf * zf / kSets;
  }
  EXPECT_GE(covered_gain, 180);
  EXPECT_GE(covered_floor, 180);
  EXPECT_GT(z2_gain, 0.5);
  EXPECT_LT(z2_gain, 1.3);
  EXPECT_GT(z2_floor, 0.5);
  EXPECT_LT(z2_floor, 1.3);
}

TEST(PhotonTransfer, PredictsTheVarianceOfFramesItHasNotSeen) {
  const SimulatedSensor sensor{.gain_dn = 0.03, .read_noise_dn = 0.5};
  std::mt19937_64 random(11);
  const auto frames_of = [&](unsigned seed, double peak) {
    const auto scene = textured_scene(128, 128, peak, seed);
    std::vector<Frame> frames;
    for (double t : {1.0, 1.0, 3.0})
      frames.push_back(simulated_frame(scene, 128, t, sensor, random));
    return frames;
  };
  const auto seen = pair_samples(frames_of(1, 2500.0), 0, plain());
  const auto unseen = pair_samples(frames_of(2, 1200.0), 1, plain());
  const NoiseCheck check = check_noise(fit_photon_transfer(seen).model, unseen);
  EXPECT_EQ(check.samples, unseen.size());
  // 128 samples of 255 degrees of freedom: 0.8 %, and as much from the fit; 4 sigma.
  EXPECT_NEAR(check.chi2_per_dof, 1.0, 0.05);
}

TEST(PhotonTransfer, SeesEachColourOfAMosaicApart) {
  std::mt19937_64 random(3);
  const auto scene = textured_scene(128, 128, 2000.0, 1);
  std::vector<Frame> frames;
  for (double t : {1.0, 2.0}) frames.push_back(simulated_frame(scene, 128, t, {}, random));
  BlockOptions options = plain();
  options.mosaic = true;
  std::size_t green = 0, all = 0;
  for (const PairSample& s : pair_samples(frames, 0, options)) {
    green += s.site == 'G';
    ++all;
    EXPECT_EQ(s.dof, 63u);
  }
  EXPECT_EQ(all, 256u);
  EXPECT_EQ(green, 128u);
}

TEST(PhotonTransfer, LeavesOutBlocksBesideSaturation) {
  std::mt19937_64 random(3);
  const auto scene = textured_scene(64, 64, 2000.0, 1);
  std::vector<Frame> frames;
  for (double t : {1.0, 2.0}) frames.push_back(simulated_frame(scene, 64, t, {}, random));
  BlockOptions options = plain();
  options.saturation_dn = 1000.0;
  ASSERT_EQ(pair_samples(frames, 0, options).size(), 16u);
  frames[1].image.channels[0].samples[frames[1].image.index(17, 17)] = 1000.0f;
  // The photosite lies in one block and within 2 px of three others.
  EXPECT_EQ(pair_samples(frames, 0, options).size(), 12u);
}

TEST(PhotonTransfer, SaysWhyItFindsNothing) {
  std::mt19937_64 random(3);
  const std::vector<double> even(64 * 64, 500.0);
  const std::vector<Frame> one = {simulated_frame(even, 64, 1.0, {}, random)};
  EXPECT_TRUE(pair_samples(one, 0, plain()).empty());
  EXPECT_THAT(fit_photon_transfer({}).why_not, testing::HasSubstr("0 blocks"));
  std::vector<PairSample> alike(40);
  for (PairSample& s : alike) {
    s.dof = 255;
    s.variance_dn2 = 2.0;
    s.gain_weight = 100.0;
  }
  EXPECT_FALSE(fit_photon_transfer(alike).found);
  EXPECT_THAT(fit_photon_transfer(alike).why_not, testing::HasSubstr("alike"));
  auto other = one;
  other.push_back(simulated_frame(std::vector<double>(64 * 32, 1.0), 64, 2.0, {}, random));
  EXPECT_THROW(pair_samples(other, 0, plain()), MismatchError);
}

// Mean 0.6 DN, sigma 0.9 DN, clipped below 0: a quarter of the readings is at the clip. 200 sets of
// 4000 readings, seed 5; limits as above.
TEST(DarkDistribution, CoversLevelAndNoiseBehindTheClip) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal(0.6, 0.9);
  int covered_mean = 0, covered_sigma = 0;
  double z2 = 0.0;
  for (int set = 0; set < 200; ++set) {
    std::vector<std::size_t> counts(16, 0);
    for (int k = 0; k < 4000; ++k)
      ++counts[static_cast<std::size_t>(std::max(std::lround(normal(random)), 0L))];
    const DarkDistribution fit = fit_dark_distribution(counts);
    ASSERT_TRUE(fit.found);
    const double z = (fit.mean_dn.value - 0.6) / fit.mean_dn.standard_uncertainty;
    covered_mean += std::abs(z) < 2.0;
    covered_sigma += std::abs(fit.sigma_dn.value - 0.9) < 2.0 * fit.sigma_dn.standard_uncertainty;
    z2 += z * z / 200.0;
  }
  EXPECT_GE(covered_mean, 180);
  EXPECT_GE(covered_sigma, 180);
  EXPECT_NEAR(z2, 1.0, 0.35);  // 3.5 sigma of chi^2 / nu at nu = 200
}

TEST(DarkDistribution, RefusesWhatNearlyAllZerosCannotTell) {
  const std::vector<std::size_t> clipped = {140082, 270};
  EXPECT_FALSE(fit_dark_distribution(clipped).found);
  EXPECT_FALSE(fit_dark_distribution({140352}, 0.4).found);
  EXPECT_FALSE(fit_dark_distribution({}).found);
  EXPECT_FALSE(fit_dark_distribution(clipped, 0.0).found);
  // With sigma known, the share above 1/2 gives the level: P(z > 2.8908) = 270 / 140352.
  const DarkDistribution level = fit_dark_distribution(clipped, 0.4);
  ASSERT_TRUE(level.found);
  EXPECT_NEAR(level.mean_dn.value, 0.5 - 2.8908 * 0.4, 1e-3);
}

}  // namespace
}  // namespace truebox

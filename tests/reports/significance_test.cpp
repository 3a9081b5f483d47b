// SPDX-License-Identifier: BSD-3-Clause
#include "difference/significance.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include "difference/regions.h"
#include "radiometry/input_error.h"
#include "uncertainty/coverage.h"

namespace truebox {
namespace {

using testing::HasSubstr;

Image plane(int width, int height, float value) {
  Image image(width, height);
  image.add_channel("Y", value);
  return image;
}

/// Mean of `samples` normal draws of standard deviation 1 for each pixel, and its standard error
/// as estimated from those draws.
struct Noisy {
  Image mean, standard_error;
};
Noisy noisy(int width, int height, int samples, double truth, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> draw(truth, 1.0);
  Noisy n{plane(width, height, 0), plane(width, height, 0)};
  for (std::size_t i = 0; i < n.mean.pixel_count(); ++i) {
    double sum = 0, square = 0;
    for (int s = 0; s < samples; ++s) {
      const double v = draw(random);
      sum += v;
      square += v * v;
    }
    const double mean = sum / samples, variance = (square - samples * mean * mean) / (samples - 1);
    n.mean.channels[0].samples[i] = static_cast<float>(mean);
    n.standard_error.channels[0].samples[i] = static_cast<float>(std::sqrt(variance / samples));
  }
  return n;
}

DifferenceMap map_of(const Noisy& a, const Noisy& b, double samples) {
  DifferenceOptions options;
  options.test_uncertainty = &a.standard_error;
  options.reference_uncertainty = &b.standard_error;
  options.test_samples = options.reference_samples = samples;
  return difference_map(a.mean, b.mean, options);
}

TEST(Significance, NoiseThatAgreesFailsAsOftenAsTheLevelSays) {
  // 200 pairs at a level of 5 %: how often the gate fails must lie in the Wilson interval of 3.3
  // sigmas around it, exceeded by chance once in a thousand runs. Eight samples a pixel: without
  // Welch's degrees of freedom it would fail nearly always, which the second half shows.
  std::size_t failed = 0, failed_as_normal = 0;
  const std::size_t trials = 200;
  for (unsigned t = 0; t < trials; ++t) {
    const Noisy a = noisy(60, 50, 8, 5.0, 2 * t), b = noisy(60, 50, 8, 5.0, 2 * t + 1);
    failed += significance(map_of(a, b, 8), {2.0, 0.05, 0.0}).outcome == Agreement::fails;
    failed_as_normal += significance(map_of(a, b, 0), {2.0, 0.05, 0.0}).outcome == Agreement::fails;
  }
  const Coverage share = coverage(failed, trials, 3.3);
  EXPECT_LE(share.low, 0.05) << failed << " of " << trials;
  // Counts are whole, so the true rate lies a little below the level.
  EXPECT_GE(share.high, 0.02) << failed << " of " << trials;
  EXPECT_GT(failed_as_normal, trials * 9 / 10);
}

TEST(Significance, OneHotPixelWarnsAndDoesNotFailAMillion) {
  const int w = 1000, h = 1000;
  std::mt19937 random(3);
  std::normal_distribution<float> draw(0.0f, 1.0f);
  Image test = plane(w, h, 0), reference = plane(w, h, 0), u = plane(w, h, 1);
  for (float& v : test.channels[0].samples) v = draw(random);
  test.channels[0].samples[test.index(123, 456)] = 100.0f;
  DifferenceOptions options;
  options.test_uncertainty = &u;
  const Significance s = significance(difference_map(test, reference, options));
  EXPECT_EQ(s.outcome, Agreement::warning);
  EXPECT_EQ(s.farthest_at.x_px, 123);
  EXPECT_EQ(s.farthest_at.y_px, 456);
  EXPECT_LT(s.farthest_p, 1e-6);
  EXPECT_NEAR(s.farthest_limit, 5.73, 0.01);  // erfc(z / sqrt 2) = 0.01 / 1e6
  EXPECT_NEAR(s.beyond_expected, 45500.26, 0.1);
}

TEST(Significance, AFaintShiftOfAllPixelsFailsThoughEachOneIsSmall) {
  const int w = 200, h = 200;
  std::mt19937 random(4);
  std::normal_distribution<float> draw(0.3f, 1.0f);  // a third of a standard error
  Image test = plane(w, h, 0), reference = plane(w, h, 0), u = plane(w, h, 1);
  for (float& v : test.channels[0].samples) v = draw(random);
  DifferenceOptions options;
  options.test_uncertainty = &u;
  const Significance s = significance(difference_map(test, reference, options));
  EXPECT_EQ(s.outcome, Agreement::fails);
  EXPECT_LT(s.chi_squared_p, 1e-9);
  EXPECT_NEAR(s.mean_z, 0.3, 5.0 / std::sqrt(w * h));
}

TEST(Significance, HistogramHoldsEverySampleAndItsExpectation) {
  Image test = plane(3, 1, 0), reference = plane(3, 1, 0), u = plane(3, 1, 1);
  test.channels[0].samples = {-100.0f, 0.25f, 100.0f};
  DifferenceOptions options;
  options.test_uncertainty = &u;
  const Significance s = significance(difference_map(test, reference, options));
  std::size_t seen = 0;
  double expected = 0;
  for (const ScoreBin& bin : s.histogram) seen += bin.seen, expected += bin.expected;
  EXPECT_EQ(seen, 3u);
  EXPECT_NEAR(expected, 3.0, 1e-12);
  EXPECT_EQ(s.histogram.front().seen, 1u);
  EXPECT_EQ(s.histogram.back().seen, 1u);
}

TEST(Significance, APixelWithoutAnUncertaintyFails) {
  Image test = plane(8, 8, 1), reference = plane(8, 8, 1), u = plane(8, 8, 1);
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), -1.0f}) {
    u.channels[0].samples[5] = bad;
    DifferenceOptions options;
    options.test_uncertainty = &u;
    const Significance s = significance(difference_map(test, reference, options));
    EXPECT_EQ(s.not_finite, 1u);
    EXPECT_EQ(s.outcome, Agreement::fails);
  }
  EXPECT_THROW(significance(difference_map(test, reference)), std::invalid_argument);
}

TEST(Significance, TwoBlackPixelsAreNoEvidence) {
  Image test = plane(4, 1, 0), reference = plane(4, 1, 0), u = plane(4, 1, 0);
  DifferenceOptions options;
  options.test_uncertainty = &u;
  EXPECT_EQ(significance(difference_map(test, reference, options)).pixels, 0u);
  EXPECT_EQ(significance(difference_map(test, reference, options)).outcome, Agreement::agrees);
  u.channels[0].samples[1] = 1.0f;
  const Significance s = significance(difference_map(test, reference, options));
  EXPECT_EQ(s.pixels, 1u);
  EXPECT_EQ(s.degrees_of_freedom, 1.0);
  test.channels[0].samples[3] = 1e-6f;  // a difference without any uncertainty is infinitely far
  EXPECT_EQ(significance(difference_map(test, reference, options)).farthest,
            std::numeric_limits<double>::infinity());
}

TEST(Uncertainty, CombinesMeasurementPredictionAndCalibration) {
  const Image test = plane(1, 1, 11), reference = plane(1, 1, 10), u = plane(1, 1, 0.3f),
              ur = plane(1, 1, 0.4f), bound = plane(1, 1, 1.2f);
  DifferenceOptions options;
  options.test_uncertainty = &u;
  options.reference_uncertainty = &ur;
  options.test_error_bound = &bound;
  options.calibration_relative = 0.05;
  const DifferenceMap map = difference_map(test, reference, options);
  // 0.3^2 + 0.4^2 + 1.2^2 / 3 + (0.05 * 10)^2 = 0.98
  EXPECT_NEAR(map.channels[0].standard_uncertainty[0], std::sqrt(0.98), 1e-6);
  EXPECT_NEAR(map.channels[0].sigmas(0), 1.0 / std::sqrt(0.98), 1e-6);
  options.test_samples = 1.5;
  EXPECT_THROW(difference_map(test, reference, options), std::invalid_argument);
}

TEST(Uncertainty, DegreesOfFreedomAreWelchs) {
  const Image v = plane(1, 1, 1), u = plane(1, 1, 2), ur = plane(1, 1, 1);
  DifferenceOptions options;
  options.test_uncertainty = &u;
  options.reference_uncertainty = &ur;
  options.test_samples = 5;
  options.reference_samples = 11;
  // (4 + 1)^2 / (4^2 / 4 + 1^2 / 10)
  EXPECT_NEAR(difference_map(v, v, options).channels[0].degrees_of_freedom[0], 25.0 / 4.1, 1e-5);
}

TEST(Regions, MeansAverageNoiseOutButNotWhatIsShared) {
  const int w = 20, h = 10;
  const Image test = plane(w, h, 10.5f), reference = plane(w, h, 10), u = plane(w, h, 1),
              bound = plane(w, h, 0.3f);
  Image ids = plane(w, h, 0);
  for (std::size_t i = 0; i < 100; ++i) ids.channels[0].samples[i] = 7;
  DifferenceOptions options;
  options.test_uncertainty = &u;
  options.test_error_bound = &bound;
  options.calibration_relative = 0.01;
  const auto regions = regions_from_ids(ids, {{7, "floor"}}, w, h);
  const auto d = region_differences(difference_map(test, reference, options), regions);
  ASSERT_EQ(d.size(), 1u);
  EXPECT_EQ(d[0].region, "floor");
  EXPECT_EQ(d[0].pixels, 100u);
  // 1^2 / 100 + 0.3^2 / 3 + (0.01 * 10)^2
  const double expected = std::sqrt(0.01 + 0.03 + 0.01);
  EXPECT_NEAR(d[0].difference.value, 0.5, 1e-6);
  EXPECT_NEAR(d[0].difference.standard_uncertainty, expected, 1e-5);
  EXPECT_NEAR(d[0].en, 0.5 / (2 * expected), 1e-5);
  EXPECT_NEAR(d[0].relative, 0.05, 1e-6);
}

TEST(Regions, RefuseWhatIsNoImageOfSurfaces) {
  Image ids = plane(2, 2, 1);
  EXPECT_THROW(regions_from_ids(ids, {}, 2, 3), MismatchError);
  EXPECT_EQ(regions_from_ids(ids, {}, 2, 2)[0].name, "region 1");
  for (float bad : {0.5f, -1.0f, 70000.0f, std::numeric_limits<float>::quiet_NaN()}) {
    ids.channels[0].samples[3] = bad;
    EXPECT_THROW(regions_from_ids(ids, {}, 2, 2), MismatchError) << bad;
  }
  EXPECT_THROW(region_from_mask("empty", plane(2, 2, 0), 2, 2), MismatchError);
}

TEST(Mask, LeavesOutEverywhere) {
  Image test = plane(4, 4, 1), reference = plane(4, 4, 1), mask = plane(4, 4, 1);
  test.channels[0].samples[2] = std::numeric_limits<float>::quiet_NaN();
  mask.channels[0].samples[2] = 0;
  DifferenceOptions options;
  options.mask = &mask;
  const DifferenceMap map = difference_map(test, reference, options);
  EXPECT_EQ(map.pixel_count(), 15u);
  EXPECT_EQ(difference_statistics(map).samples, 15u);
  EXPECT_EQ(apply_limits(map, {}).outcome, Agreement::agrees);
  mask = plane(4, 4, 0);
  EXPECT_THROW(difference_map(test, reference, options), MismatchError);
}

}  // namespace
}  // namespace truebox

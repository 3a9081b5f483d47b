// SPDX-License-Identifier: BSD-3-Clause
#include "alignment/edge_localisation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "scene/polygon.h"
#include "uncertainty/distributions.h"

namespace truebox {
namespace {

std::array<double, 2> direction(double angle_deg) {
  const double a = angle_deg * M_PI / 180.0;
  return {std::cos(a), std::sin(a)};
}

/// A step of 0.2 to 0.7 whose edge is `offset` along the normal from the centre of a 41 x 41
/// picture. A pixel is the area of its square on the far side: found by clipping, not by the
/// formula under test. `shading` is added by distance from the edge.
EdgePlanes step_picture(const std::array<double, 2>& normal, double offset,
                        const std::function<double(double)>& shading, double noise,
                        std::mt19937_64& random) {
  std::normal_distribution<double> gauss;
  EdgePlanes planes{41, 41, 1, {std::vector<float>(41 * 41)}, {}};
  const Plane side{{normal[0], normal[1], 0.0}, normal[0] * 20.5 + normal[1] * 20.5 + offset};
  for (int y = 0; y < 41; ++y)
    for (int x = 0; x < 41; ++x) {
      const Polygon pixel = {{x + 0.0, y + 0.0, 0},
                             {x + 1.0, y + 0.0, 0},
                             {x + 1.0, y + 1.0, 0},
                             {x + 0.0, y + 1.0, 0}};
      Polygon kept;
      clip(pixel, side, 1e-12, kept);
      const double area = kept.size() < 3 ? 0.0 : area_vector(kept).norm();
      const double d = side.distance_m({x + 0.5, y + 0.5, 0.0});
      planes.linear[0][planes.index(x, y)] = static_cast<float>(
          0.2 + 0.5 * area + (shading ? shading(d) : 0.0) + noise * gauss(random));
    }
  return planes;
}

TEST(BlurredStep, IsTheIntegralItSays) {
  for (const double angle : {0.0, 0.01, 17.0, 45.0, 80.0, 90.0})
    for (const double sigma : {0.05, 0.4, 1.5})
      for (const double d : {-1.2, -0.3, 0.0, 0.45, 2.0}) {
        const auto n = direction(angle);
        // Midpoints over the pixel's square of the normal distribution function.
        constexpr int kPoints = 400;
        double sum = 0.0;
        for (int i = 0; i < kPoints; ++i)
          for (int k = 0; k < kPoints; ++k) {
            const double x = (i + 0.5) / kPoints - 0.5, y = (k + 0.5) / kPoints - 0.5;
            sum += 0.5 * std::erfc(-(d + n[0] * x + n[1] * y) / (sigma * std::sqrt(2.0)));
          }
        // Second order in 1/400 over a kernel of width sigma.
        EXPECT_NEAR(blurred_step(d, sigma, n).value, sum / (kPoints * kPoints), 1e-4)
            << angle << " " << sigma << " " << d;
      }
}

TEST(BlurredStep, DerivativesAgreeWithDifferences) {
  constexpr double h = 1e-5;
  for (const double angle : {0.0, 30.0, 45.0})
    for (const double sigma : {0.1, 0.7})
      for (const double d : {-0.6, 0.1, 0.4}) {
        const auto n = direction(angle);
        const BlurredStep at = blurred_step(d, sigma, n);
        EXPECT_NEAR(
            at.by_distance,
            (blurred_step(d + h, sigma, n).value - blurred_step(d - h, sigma, n).value) / (2 * h),
            1e-6);
        EXPECT_NEAR(
            at.by_sigma,
            (blurred_step(d, sigma + h, n).value - blurred_step(d, sigma - h, n).value) / (2 * h),
            1e-6);
      }
}

TEST(LocalisedEdge, FindsAnExactStepAtEveryAngleAndPhase) {
  std::mt19937_64 random(1);
  for (const double angle : {0.0, 3.0, 26.5, 45.0, 90.0, 171.0})
    for (const double offset : {-1.7, -0.5, 0.0, 0.25, 0.9}) {
      const auto n = direction(angle);
      const auto planes = step_picture(n, offset, {}, 0.0, random);
      const auto found = localised_edge(planes, {{20.5, 20.5}, n, 6.0, 5.0});
      ASSERT_TRUE(found) << angle << " " << offset;
      // The least blur of the model is 0.02 px; the picture has none.
      EXPECT_NEAR(found->offset_px, offset, 0.003) << angle << " " << offset;
    }
}

TEST(LocalisedEdge, IsNotMovedByShadingThatIsLinearOnEachSide) {
  std::mt19937_64 random(2);
  const auto n = direction(20.0);
  const auto slope = [](double d) { return d > 0.0 ? -0.02 * d : 0.01 * d; };
  const auto planes = step_picture(n, 0.3, slope, 0.0, random);
  const auto found = localised_edge(planes, {{20.5, 20.5}, n, 6.0, 5.0});
  ASSERT_TRUE(found);
  // The shading is taken at pixel centres: on the edge's own pixels that is not quite their mean.
  EXPECT_NEAR(found->offset_px, 0.3, 0.02);
}

// Light between two walls falls off towards where they touch, steeper than linearly.
TEST(LocalisedEdge, IsMovedByContactShadingByAFewHundredths) {
  std::mt19937_64 random(3);
  const auto n = direction(20.0);
  for (const double reach_px : {3.0, 10.0, 30.0}) {
    const auto contact = [&](double d) { return d > 0.0 ? -0.1 * std::exp(-d / reach_px) : 0.0; };
    double worst = 0.0;
    for (double phase = -0.5; phase < 0.5; phase += 0.1) {
      const auto found =
          localised_edge(step_picture(n, phase, contact, 0.0, random), {{20.5, 20.5}, n, 6.0, 5.0});
      ASSERT_TRUE(found);
      worst = std::max(worst, std::abs(found->offset_px - phase));
    }
    std::printf("contact shading of 20 %% of the step over %g px: bias up to %.3f px\n", reach_px,
                worst);
    // Over many px it is a straight line within the window, over one px part of the blur; what
    // biases is the curvature between. A tenth of the blurred step's width is what is allowed.
    EXPECT_LT(worst, 0.05);
  }
}

TEST(LocalisedEdge, UncertaintyCoversTheTruth) {
  constexpr std::size_t kTrials = 400;
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> uniform;
  std::size_t misses = 0, found_count = 0;
  for (std::size_t i = 0; i < kTrials; ++i) {
    const auto n = direction(180.0 * uniform(random));
    const double offset = uniform(random) - 0.5;
    const auto found =
        localised_edge(step_picture(n, offset, {}, 0.05, random), {{20.5, 20.5}, n, 6.0, 5.0});
    if (!found) continue;
    ++found_count;
    misses += std::abs(found->offset_px - offset) > 2.0 * found->u_px;
  }
  EXPECT_EQ(found_count, kTrials);  // the step is ten times the noise
  EXPECT_GT(binomial_upper_tail(misses, kTrials, 0.0455), 1e-3) << misses;
  EXPECT_GT(1.0 - binomial_upper_tail(misses + 1, kTrials, 0.0455), 1e-3) << misses;
}

TEST(LocalisedEdge, SeesNoneInNoiseAlone) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> gauss;
  std::size_t found = 0;
  for (int i = 0; i < 200; ++i) {
    EdgePlanes planes{41, 41, 1, {std::vector<float>(41 * 41)}, {}};
    for (float& v : planes.linear[0]) v = static_cast<float>(0.5 + 0.05 * gauss(random));
    found += localised_edge(planes, {{20.5, 20.5}, direction(1.8 * i), 6.0, 5.0}).has_value();
  }
  // The best of many places for a step reaches 4 sigma at times.
  EXPECT_LT(found, 20u);
  EdgePlanes even{41, 41, 1, {std::vector<float>(41 * 41, 0.5f)}, {}};
  EXPECT_FALSE(localised_edge(even, {{20.5, 20.5}, {1.0, 0.0}, 6.0, 5.0}));
  EXPECT_FALSE(localised_edge(even, {{-100.0, 20.5}, {1.0, 0.0}, 6.0, 5.0}));
}

}  // namespace
}  // namespace truebox

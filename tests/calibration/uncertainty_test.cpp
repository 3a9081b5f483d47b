// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "uncertainty/coverage.h"
#include "uncertainty/en_score.h"
#include "uncertainty/uncertainty_budget.h"

namespace truebox {
namespace {

constexpr double kRounding = 1e-14;  // relative: a handful of double operations

TEST(EnScore, IsTheDifferenceInExpandedUncertainties) {
  // |10.5 - 10| / (2 sqrt(0.3^2 + 0.4^2)) = 0.5.
  const EnScore score = en_score({10.5, 0.3}, {10.0, 0.4});
  EXPECT_NEAR(score.value, 0.5, kRounding);
  EXPECT_TRUE(score.agrees());
  EXPECT_NEAR(en_score({8.9, 0.3}, {10.0, 0.4}).value, -1.1, 10 * kRounding);
  EXPECT_FALSE(en_score({8.9, 0.3}, {10.0, 0.4}).agrees());
}

TEST(EnScore, WithoutUncertaintyAgreesOnlyWithItself) {
  EXPECT_EQ(en_score({1.0, 0.0}, {1.0, 0.0}).value, 0.0);
  EXPECT_EQ(en_score({2.0, 0.0}, {1.0, 0.0}).value, std::numeric_limits<double>::infinity());
  EXPECT_FALSE(en_score({2.0, 0.0}, {1.0, 0.0}).agrees());
}

TEST(UncertaintyBudget, CombinesInQuadrature) {
  UncertaintyBudget budget;
  EXPECT_EQ(budget.combined(), 0.0);
  budget.add("noise", 3.0);
  budget.add("scale", 4.0);
  EXPECT_NEAR(budget.combined(), 5.0, 5 * kRounding);
  EXPECT_EQ(budget.of("scale"), 4.0);
  EXPECT_EQ(budget.of("absent"), 0.0);
}

TEST(UncertaintyBudget, RefusesWhatIsNoUncertainty) {
  UncertaintyBudget budget;
  EXPECT_THROW(budget.add("negative", -1e-9), std::invalid_argument);
  EXPECT_THROW(budget.add("unknown", std::nan("")), std::invalid_argument);
  EXPECT_TRUE(budget.contributions().empty());
}

TEST(Coverage, IsTheWilsonInterval) {
  // Wilson (1927) at z = 2 for 95 of 100: centre (0.95 + 0.02) / 1.04, half width
  // 2 / 1.04 sqrt(0.95 * 0.05 / 100 + 4 / 40000).
  const Coverage result = coverage(95, 100);
  const double centre = 0.97 / 1.04, half = 2.0 / 1.04 * std::sqrt(0.000475 + 0.0001);
  EXPECT_NEAR(result.fraction, 0.95, kRounding);
  EXPECT_NEAR(result.low, centre - half, kRounding);
  EXPECT_NEAR(result.high, centre + half, kRounding);
  EXPECT_EQ(coverage(0, 0).high, 1.0);
}

}  // namespace
}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "uncertainty/missing_contribution.h"

#include <gmock/gmock.h>

#include <random>

namespace truebox {
namespace {

using testing::HasSubstr;

/// 200 pairs whose budgets are true but for what is planted.
std::vector<ComparedPair> pairs_with(double offset, double scale) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::vector<ComparedPair> pairs;
  for (int k = 0; k < 200; ++k) {
    const double truth = 0.05 + 0.004 * k, u = 0.004, u_reference = 0.003;
    pairs.push_back({{truth * (1.0 + scale) + offset + u * normal(random), u},
                     {truth + u_reference * normal(random), u_reference}});
  }
  return pairs;
}

TEST(MissingContribution, IsNoneWhereTheBudgetIsTrue) {
  const MissingContribution missing = missing_contribution(pairs_with(0.0, 0.0));
  EXPECT_GE(missing.agreeing, 190u);
  EXPECT_FALSE(missing.is_missing());
  EXPECT_THAT(missing.in_words(), HasSubstr("no contribution is missing"));
}

TEST(MissingContribution, IsNamedAsAnOffsetWhereLightWasSubtracted) {
  const MissingContribution missing = missing_contribution(pairs_with(-0.01, 0.0));
  EXPECT_TRUE(missing.is_missing());
  EXPECT_NEAR(missing.offset.value, -0.01, 4.0 * missing.offset.standard_uncertainty);
  EXPECT_THAT(missing.in_words(), HasSubstr("errors of one sign"));
  EXPECT_THAT(missing.in_words(), HasSubstr("missing is an additive contribution"));
  EXPECT_THAT(missing.in_words(), HasSubstr("black level or veil"));
}

TEST(MissingContribution, IsNamedAsAScaleWhereReadingsAreTooHighInProportion) {
  const MissingContribution missing = missing_contribution(pairs_with(0.0, 0.03));
  EXPECT_TRUE(missing.is_missing());
  EXPECT_NEAR(missing.slope.value, 0.03, 4.0 * missing.slope.standard_uncertainty);
  EXPECT_THAT(missing.in_words(), HasSubstr("missing is a relative contribution"));
}

TEST(MissingContribution, IsJustAsLargeAsLetsNinetyFivePercentAgree) {
  std::vector<ComparedPair> pairs = pairs_with(-0.012, 0.0);
  const double u = missing_contribution(pairs).additive_u;
  const auto with = [&](double more) {
    std::vector<ComparedPair> enlarged = pairs;
    for (ComparedPair& p : enlarged)
      p.measured.standard_uncertainty = std::hypot(p.measured.standard_uncertainty, more);
    return missing_contribution(enlarged).agreeing;
  };
  EXPECT_GE(with(1.0001 * u), 190u);
  EXPECT_LT(with(0.99 * u), 190u);
}

}  // namespace
}  // namespace truebox

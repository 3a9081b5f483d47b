// SPDX-License-Identifier: BSD-3-Clause
#include "uncertainty/distributions.h"

#include <gtest/gtest.h>

#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace truebox {
namespace {

TEST(Distributions, MatchPrintedTables) {
  // Abramowitz & Stegun (1964), tables 26.1, 26.5, 26.8: as many digits as are printed.
  EXPECT_NEAR(normal_two_sided_tail(1.0), 0.3173105, 1e-7);
  EXPECT_NEAR(normal_two_sided_tail(2.0), 0.0455003, 1e-7);
  EXPECT_NEAR(normal_two_sided_quantile(0.05), 1.959964, 1e-6);
  EXPECT_NEAR(chi_squared_upper_tail(3.841459, 1.0), 0.05, 1e-7);
  EXPECT_NEAR(chi_squared_upper_tail(18.307038, 10.0), 0.05, 1e-7);
  EXPECT_NEAR(binomial_upper_tail(8, 10, 0.5), 56.0 / 1024.0, 1e-14);  // 45 + 10 + 1
}

TEST(Distributions, ChiSquaredOfManyDegreesOfFreedomMayBeNothing) {
  for (const double chi2 : {0.0, 1e-300, 1.0, 1e5})
    EXPECT_EQ(chi_squared_upper_tail(chi2, 458752.0), 1.0);
  EXPECT_EQ(chi_squared_upper_tail(0.0, 1.0), 1.0);
  // With two degrees of freedom the tail is exp(-chi^2 / 2): no jump where the bound takes over.
  EXPECT_NEAR(chi_squared_upper_tail(1e-3, 2.0), std::exp(-5e-4), 1e-15);
  // The median lies 2/3 below the mean: the share above the mean is 1/2 - 1/3 / sqrt(pi n).
  EXPECT_NEAR(chi_squared_upper_tail(458752.0, 458752.0),
              0.5 - 1.0 / 3.0 / std::sqrt(3.14159265 * 458752.0), 1e-6);
}

TEST(Distributions, QuantileUndoesTail) {
  for (double z : {0.1, 1.0, 2.0, 5.0, 8.0})
    EXPECT_NEAR(normal_two_sided_quantile(normal_two_sided_tail(z)), z, 1e-10 * z);
}

TEST(Distributions, BinomialLimitIsTheFirstCountThatIsRareEnough) {
  for (std::size_t trials : {1u, 10u, 1000u, 1000000u})
    for (double p : {0.0, 0.0455, 0.5}) {
      const std::size_t limit = binomial_upper_limit(trials, p, 0.01);
      EXPECT_LE(binomial_upper_tail(limit + 1, trials, p), 0.01);
      if (limit > 0) {
        EXPECT_GT(binomial_upper_tail(limit, trials, p), 0.01);
      }
    }
}

TEST(Distributions, StudentScoreKeepsTheTailOfTheExactDistribution) {
  // Against Boost's distribution; the bound is the one that the header states.
  for (double nu : {3.0, 7.0, 30.0, 1023.0}) {
    const boost::math::students_t exact(nu);
    for (double t = -9.0; t <= 9.0; t += 0.25) {
      const double p = 2.0 * boost::math::cdf(boost::math::complement(exact, std::abs(t)));
      if (p < 1e-6) continue;
      EXPECT_NEAR(normal_score_of_student_t(t, nu), std::copysign(normal_two_sided_quantile(p), t),
                  nu < 7.0 ? 0.06 : 0.03)
          << t << ", nu = " << nu;
    }
  }
  EXPECT_EQ(normal_score_of_student_t(3.0, std::numeric_limits<double>::infinity()), 3.0);
  EXPECT_LT(normal_score_of_student_t(1e6, 5.0), 30.0);  // heavy tails: far, but not out of reach
}

TEST(Distributions, SidakKeepsTheFamilyAtItsLevel) {
  const double level = sidak_level(0.01, 1000000);
  EXPECT_NEAR(1.0 - std::pow(1.0 - level, 1e6), 0.01, 1e-9);
  EXPECT_DOUBLE_EQ(sidak_level(0.05, 1), 0.05);
}

TEST(Distributions, RefuseWhatIsNoProbability) {
  EXPECT_THROW(normal_two_sided_quantile(0.0), std::invalid_argument);
  EXPECT_THROW(normal_two_sided_quantile(1.1), std::invalid_argument);
  EXPECT_THROW(binomial_upper_tail(1, 2, -0.1), std::invalid_argument);
  EXPECT_THROW(chi_squared_upper_tail(1.0, 0.0), std::invalid_argument);
  EXPECT_THROW(normal_score_of_student_t(1.0, 0.5), std::invalid_argument);
  EXPECT_THROW(sidak_level(1.0, 3), std::invalid_argument);
}

}  // namespace
}  // namespace truebox

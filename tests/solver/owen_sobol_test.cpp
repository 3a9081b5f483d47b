// SPDX-License-Identifier: BSD-3-Clause
#include "path_tracer/owen_sobol.h"

#include <gmock/gmock.h>

#include <cmath>
#include <set>
#include <vector>

namespace truebox {
namespace {

// A (0, k, 2)-net: each of the 2^k intervals of any shape holds one of 2^k points.
TEST(OwenSobol, FillsEveryElementaryIntervalOnce) {
  constexpr unsigned kPoints = 64;
  for (std::uint32_t seed = 1; seed <= 20; ++seed)
    for (const unsigned first : {0u, kPoints, 7 * kPoints})
      for (unsigned columns = 1; columns <= kPoints; columns *= 2) {
        std::set<unsigned> cells;
        for (unsigned k = 0; k < kPoints; ++k) {
          const UnitPair p = owen_sobol_pair(first + k, seed);
          const unsigned rows = kPoints / columns;
          cells.insert(static_cast<unsigned>(p.u * columns) * rows +
                       static_cast<unsigned>(p.v * rows));
        }
        EXPECT_EQ(cells.size(), kPoints) << "seed " << seed << ", " << columns << " columns";
      }
}

TEST(OwenSobol, EachPointIsUniformOverSeeds) {
  constexpr int kSide = 16, kSeeds = 40000;
  for (const std::uint32_t index : {0u, 5u, 1000u}) {
    std::vector<int> cell(kSide * kSide, 0);
    for (std::uint32_t s = 0; s < kSeeds; ++s) {
      const UnitPair p = owen_sobol_pair(index, static_cast<std::uint32_t>(mixed(99, s)));
      ++cell[static_cast<int>(p.u * kSide) * kSide + static_cast<int>(p.v * kSide)];
    }
    const double expected = kSeeds / double(kSide * kSide);
    double chi2 = 0.0;
    for (int n : cell) chi2 += (n - expected) * (n - expected) / expected;
    // chi^2 of 255 degrees of freedom: mean 255, standard deviation 22.6; 5 of them, three tests.
    EXPECT_NEAR(chi2, 255.0, 5 * 22.6) << "index " << index;
  }
}

TEST(OwenSobol, ConvergesFasterThanChanceWhereTheIntegrandIsSmooth) {
  const auto f = [](UnitPair p) { return std::exp(p.u) * std::cos(p.v); };
  const double exact = (std::exp(1.0) - 1.0) * std::sin(1.0);
  double error2 = 0.0, variance = 0.0, mean = 0.0;
  constexpr unsigned kPoints = 256, kSeeds = 200;
  for (std::uint32_t seed = 0; seed < kSeeds; ++seed) {
    double sum = 0.0;
    for (std::uint32_t k = 0; k < kPoints; ++k) {
      const double value = f(owen_sobol_pair(k, static_cast<std::uint32_t>(mixed(7, seed))));
      sum += value;
      variance += (value - exact) * (value - exact) / (kPoints * kSeeds);
    }
    mean += sum / kPoints / kSeeds;
    error2 += std::pow(sum / kPoints - exact, 2) / kSeeds;
  }
  // Owen (1997): variance n^-3 (log n) for smooth integrands against n^-1; n^-2 is asked for.
  EXPECT_LT(error2, variance / kPoints / kPoints * 2.0);
  EXPECT_NEAR(mean, exact, 5.0 * std::sqrt(error2 / kSeeds)) << "unbiased";
}

TEST(OwenSobol, OtherSeedsAreOtherPoints) {
  int same = 0;
  for (std::uint32_t k = 0; k < 1000; ++k)
    same += owen_sobol_pair(k, 1).u == owen_sobol_pair(k, 2).u;
  EXPECT_EQ(same, 0);
}

}  // namespace
}  // namespace truebox

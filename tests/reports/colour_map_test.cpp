// SPDX-License-Identifier: BSD-3-Clause
#include "figures/colour_map.h"

#include <gtest/gtest.h>

#include <cmath>

#include "difference/ciede2000.h"

namespace truebox {
namespace {

Lab lab_of(const Rgb8& colour) {
  double linear[3];
  for (std::size_t c = 0; c < 3; ++c) {
    const double v = colour[c] / 255.0;
    linear[c] = v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
  }
  const auto [r, g, b] = linear;
  return cielab(
      {0.4124564 * r + 0.3575761 * g + 0.1804375 * b, 0.2126729 * r + 0.7151522 * g + 0.0721750 * b,
       0.0193339 * r + 0.1191920 * g + 0.9503041 * b},
      {0.95047, 1.0, 1.08883});
}

// L* of one 8-bit step in one channel: what rounding to bytes may take back.
constexpr double kByteRoundingL = 0.3;

TEST(SequentialMap, LightnessRisesSteadily) {
  double last = lab_of(sequential_colour(0.0)).L;
  EXPECT_LT(last, 20.0);
  for (int i = 1; i <= 100; ++i) {
    const double lightness = lab_of(sequential_colour(i / 100.0)).L;
    EXPECT_GT(lightness, last - kByteRoundingL) << i;
    if (i % 10 == 0) {
      EXPECT_GT(lightness, lab_of(sequential_colour((i - 10) / 100.0)).L + 4.0) << i;
    }
    last = lightness;
  }
  EXPECT_GT(last, 88.0);
}

TEST(SequentialMap, IsViridis) {
  // Rows 0, 128 and 255 of the published table; the polynomial is within 4/255 of the middle and
  // 5/255 of the ends, a difference nobody sees.
  constexpr int kFit = 5;
  const Rgb8 published[] = {{68, 1, 84}, {32, 144, 140}, {253, 231, 37}};
  for (int i = 0; i < 3; ++i)
    for (std::size_t c = 0; c < 3; ++c)
      EXPECT_NEAR(sequential_colour(i / 2.0)[c], published[i][c], kFit) << i << " " << c;
}

TEST(DivergingMap, IsNeutralAtZeroAndEquallyLightOnBothSides) {
  const Rgb8 zero = diverging_colour(0.0);
  EXPECT_EQ(zero[0], zero[1]);
  EXPECT_EQ(zero[1], zero[2]);
  for (int i = 1; i <= 20; ++i) {
    const Lab below = lab_of(diverging_colour(-i / 20.0)),
              above = lab_of(diverging_colour(i / 20.0));
    EXPECT_NEAR(below.L, above.L, 1.0) << i;  // both follow M cos(s); sRGB's gamut clips a little
    EXPECT_LT(above.L, lab_of(diverging_colour((i - 1) / 20.0)).L + kByteRoundingL);
    EXPECT_LT(below.b, 0.0);
    EXPECT_GT(above.a, 0.0);
  }
}

TEST(DivergingMap, HasMorelandsEnds) {
  // Moreland (2009), table 1: (59, 76, 192) and (180, 4, 38), from Msh rounded to three digits.
  constexpr int kRoundedMsh = 5;
  const Rgb8 cool = diverging_colour(-1.0), warm = diverging_colour(1.0);
  const int expected[2][3] = {{59, 76, 192}, {180, 4, 38}};
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(cool[c], expected[0][c], kRoundedMsh);
    EXPECT_NEAR(warm[c], expected[1][c], kRoundedMsh);
  }
}

}  // namespace
}  // namespace truebox

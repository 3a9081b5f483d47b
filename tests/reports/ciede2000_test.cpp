// SPDX-License-Identifier: BSD-3-Clause
#include "difference/ciede2000.h"

#include <gtest/gtest.h>

namespace truebox {
namespace {

struct CertifiedPair {
  Lab first, second;
  double difference;
};

// Sharma, Wu, Dalal (2005), table 1: all 34 pairs, chosen to visit every branch of the formula.
constexpr CertifiedPair kPairs[] = {
    {{50.0000, 2.6772, -79.7751}, {50.0000, 0.0000, -82.7485}, 2.0425},
    {{50.0000, 3.1571, -77.2803}, {50.0000, 0.0000, -82.7485}, 2.8615},
    {{50.0000, 2.8361, -74.0200}, {50.0000, 0.0000, -82.7485}, 3.4412},
    {{50.0000, -1.3802, -84.2814}, {50.0000, 0.0000, -82.7485}, 1.0000},
    {{50.0000, -1.1848, -84.8006}, {50.0000, 0.0000, -82.7485}, 1.0000},
    {{50.0000, -0.9009, -85.5211}, {50.0000, 0.0000, -82.7485}, 1.0000},
    {{50.0000, 0.0000, 0.0000}, {50.0000, -1.0000, 2.0000}, 2.3669},
    {{50.0000, -1.0000, 2.0000}, {50.0000, 0.0000, 0.0000}, 2.3669},
    {{50.0000, 2.4900, -0.0010}, {50.0000, -2.4900, 0.0009}, 7.1792},
    {{50.0000, 2.4900, -0.0010}, {50.0000, -2.4900, 0.0010}, 7.1792},
    {{50.0000, 2.4900, -0.0010}, {50.0000, -2.4900, 0.0011}, 7.2195},
    {{50.0000, 2.4900, -0.0010}, {50.0000, -2.4900, 0.0012}, 7.2195},
    {{50.0000, -0.0010, 2.4900}, {50.0000, 0.0009, -2.4900}, 4.8045},
    {{50.0000, -0.0010, 2.4900}, {50.0000, 0.0010, -2.4900}, 4.8045},
    {{50.0000, -0.0010, 2.4900}, {50.0000, 0.0011, -2.4900}, 4.7461},
    {{50.0000, 2.5000, 0.0000}, {50.0000, 0.0000, -2.5000}, 4.3065},
    {{50.0000, 2.5000, 0.0000}, {73.0000, 25.0000, -18.0000}, 27.1492},
    {{50.0000, 2.5000, 0.0000}, {61.0000, -5.0000, 29.0000}, 22.8977},
    {{50.0000, 2.5000, 0.0000}, {56.0000, -27.0000, -3.0000}, 31.9030},
    {{50.0000, 2.5000, 0.0000}, {58.0000, 24.0000, 15.0000}, 19.4535},
    {{50.0000, 2.5000, 0.0000}, {50.0000, 3.1736, 0.5854}, 1.0000},
    {{50.0000, 2.5000, 0.0000}, {50.0000, 3.2972, 0.0000}, 1.0000},
    {{50.0000, 2.5000, 0.0000}, {50.0000, 1.8634, 0.5757}, 1.0000},
    {{50.0000, 2.5000, 0.0000}, {50.0000, 3.2592, 0.3350}, 1.0000},
    {{60.2574, -34.0099, 36.2677}, {60.4626, -34.1751, 39.4387}, 1.2644},
    {{63.0109, -31.0961, -5.8663}, {62.8187, -29.7946, -4.0864}, 1.2630},
    {{61.2901, 3.7196, -5.3901}, {61.4292, 2.2480, -4.9620}, 1.8731},
    {{35.0831, -44.1164, 3.7933}, {35.0232, -40.0716, 1.5901}, 1.8645},
    {{22.7233, 20.0904, -46.6940}, {23.0331, 14.9730, -42.5619}, 2.0373},
    {{36.4612, 47.8580, 18.3852}, {36.2715, 50.5065, 21.2231}, 1.4146},
    {{90.8027, -2.0831, 1.4410}, {91.1528, -1.6435, 0.0447}, 1.4441},
    {{90.9257, -0.5406, -0.9208}, {88.6381, -0.8985, -0.7239}, 1.5381},
    {{6.7747, -0.2908, -2.4247}, {5.8714, -0.0985, -2.2286}, 0.6377},
    {{2.0776, 0.0795, -1.1350}, {0.9033, -0.0636, -0.5514}, 0.9082},
};

// The table is published with four decimals, so half a unit of the last is its own rounding.
constexpr double kPublishedRounding = 0.5e-4 + 1e-9;

TEST(Ciede2000, ReproducesAllPublishedPairs) {
  ASSERT_EQ(std::size(kPairs), 34u);
  for (const auto& pair : kPairs)
    EXPECT_NEAR(ciede2000(pair.first, pair.second), pair.difference, kPublishedRounding)
        << pair.first.a << " " << pair.first.b << " / " << pair.second.a << " " << pair.second.b;
}

TEST(Ciede2000, IsSymmetric) {
  for (const auto& pair : kPairs)
    EXPECT_NEAR(ciede2000(pair.first, pair.second), ciede2000(pair.second, pair.first),
                1e-12 * pair.difference);
}

TEST(Cielab, WhiteIsOneHundredAndTheSeamIsContinuous) {
  const Tristimulus white{95.047, 100.0, 108.883};
  const Lab at_white = cielab(white, white);
  EXPECT_DOUBLE_EQ(at_white.L, 100.0);
  EXPECT_DOUBLE_EQ(at_white.a, 0.0);
  EXPECT_DOUBLE_EQ(at_white.b, 0.0);
  // CIE 15:2018: L* = 903.3 Y/Yn up to Y/Yn = 0.008856, so L* = 8 at the seam.
  EXPECT_NEAR(cielab({0, 100 * 0.0088564, 0}, white).L, 8.0, 1e-4);
  EXPECT_NEAR(cielab({0, 100 * 0.0088565, 0}, white).L, 8.0, 1e-3);
  EXPECT_THROW(cielab(white, {0, 0, 0}), std::invalid_argument);
}

TEST(Cielab, PutsTheSrgbRedWhereTheLiteratureHasIt) {
  // BT.709 red in D65: Y = 0.2126; L* a* b* = 53.24 80.09 67.20 (IEC 61966-2-1 primaries).
  const Lab red = cielab({41.2456, 21.2673, 1.9334}, {95.047, 100.0, 108.883});
  constexpr double kTwoDecimals = 0.01;
  EXPECT_NEAR(red.L, 53.24, kTwoDecimals);
  EXPECT_NEAR(red.a, 80.09, kTwoDecimals);
  EXPECT_NEAR(red.b, 67.20, kTwoDecimals);
}

}  // namespace
}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "difference/difference_statistics.h"
#include "radiometry/input_error.h"

namespace truebox {
namespace {

using testing::HasSubstr;

Image grey(int width, int height, float value, const std::string& channel = "Y") {
  Image image(width, height);
  image.add_channel(channel, value);
  return image;
}

template <class Call>
std::string mismatch_text(Call call) {
  try {
    call();
  } catch (const MismatchError& error) {
    return error.what();
  }
  return "no MismatchError";
}

TEST(Difference, FindsThePlantedBlockAndNothingElse) {
  const Image reference = grey(64, 48, 1.0f);
  Image test = reference;
  for (int y = 20; y < 33; ++y)
    for (int x = 7; x < 18; ++x) test.channels[0].samples[test.index(x, y)] += 0.5f;
  const DifferenceMap map = difference_map(test, reference);
  const DifferenceGate gate = apply_limits(map, {DifferenceScale::absolute, 0.25, 0.4, 0.0});
  EXPECT_EQ(gate.pixels_over_fail, 143u);  // 11 x 13
  EXPECT_EQ(gate.outcome, Agreement::fails);
  const DifferenceStatistics s = difference_statistics(map);
  EXPECT_TRUE(s.max_at.x_px >= 7 && s.max_at.x_px < 18);
  EXPECT_TRUE(s.max_at.y_px >= 20 && s.max_at.y_px < 33);
  EXPECT_EQ(s.max_at.channel, "Y");
  EXPECT_DOUBLE_EQ(s.max_absolute, 0.5);
  EXPECT_DOUBLE_EQ(s.bias, 0.5 * 143 / (64 * 48));
  EXPECT_DOUBLE_EQ(s.rms, std::sqrt(0.25 * 143 / (64 * 48)));
  EXPECT_DOUBLE_EQ(s.relative_bias, s.bias);  // the reference is 1
  EXPECT_EQ(s.p50, 0.0);
  EXPECT_EQ(s.p99, 0.5);  // 143 of 3072 is 4.7 %
}

TEST(Difference, OutliersUpToTheAllowedFractionPass) {
  const Image reference = grey(10, 10, 1.0f);
  Image test = reference;
  for (std::size_t i = 0; i < 3; ++i) test.channels[0].samples[i] = 2.0f;
  const auto outcome = [&](double fraction) {
    return apply_limits(difference_map(test, reference),
                        {DifferenceScale::absolute, 0.1, 0.5, fraction})
        .outcome;
  };
  EXPECT_EQ(outcome(0.03), Agreement::agrees);
  EXPECT_EQ(outcome(0.02), Agreement::fails);
}

TEST(Difference, BetweenTheLimitsIsAWarning) {
  const DifferenceMap map = difference_map(grey(4, 4, 1.02f), grey(4, 4, 1.0f));
  EXPECT_EQ(apply_limits(map, {DifferenceScale::relative, 0.01, 0.05}).outcome, Agreement::warning);
  EXPECT_EQ(apply_limits(map, {DifferenceScale::relative, 0.03, 0.05}).outcome, Agreement::agrees);
}

TEST(Difference, WhatIsNoNumberNeverPasses) {
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    Image test = grey(8, 8, 1.0f), reference = grey(8, 8, 1.0f);
    test.channels[0].samples[9] = bad;
    reference.channels[0].samples[9] = bad;  // even where both agree
    const DifferenceMap map = difference_map(test, reference);
    const DifferenceGate gate = apply_limits(map, {DifferenceScale::absolute, 1e6, 1e6, 1.0});
    EXPECT_EQ(gate.outcome, Agreement::fails);
    EXPECT_EQ(gate.pixels_not_finite, 1u);
    EXPECT_EQ(difference_statistics(map).not_finite, 1u);
    EXPECT_EQ(difference_statistics(map).rms, 0.0);  // of the 63 others
  }
}

TEST(Difference, CountsInSigmasOfBothUncertainties) {
  const Image test = grey(5, 5, 1.5f), reference = grey(5, 5, 1.0f);
  const Image u_test = grey(5, 5, 0.3f), u_reference = grey(5, 5, 0.4f);
  DifferenceOptions options;
  options.test_uncertainty = &u_test;
  options.reference_uncertainty = &u_reference;
  const DifferenceMap map = difference_map(test, reference, options);
  constexpr double kFloatRounding = 1e-6;  // 0.3 and 0.4 are not exact in float
  EXPECT_NEAR(map.channels[0].sigmas(0), 1.0, kFloatRounding);
  EXPECT_NEAR(difference_statistics(map).rms_sigmas, 1.0, kFloatRounding);
  EXPECT_THROW(apply_limits(difference_map(test, reference), {DifferenceScale::sigmas, 2, 3}),
               std::invalid_argument);
}

TEST(Difference, WithoutUncertaintyADifferenceIsInfinitelyFar) {
  const Image zero_u = grey(2, 2, 0.0f);
  DifferenceOptions options;
  options.reference_uncertainty = &zero_u;
  const DifferenceLimits limits{DifferenceScale::sigmas, 3, 5, 0.0};
  EXPECT_EQ(apply_limits(difference_map(grey(2, 2, 1), grey(2, 2, 1), options), limits).outcome,
            Agreement::agrees);
  EXPECT_EQ(apply_limits(difference_map(grey(2, 2, 1.1f), grey(2, 2, 1), options), limits).outcome,
            Agreement::fails);
}

TEST(Difference, OtherSizesAreRefusedWithBothSaid) {
  const std::string text =
      mismatch_text([] { difference_map(grey(640, 480, 0), grey(512, 512, 0)); });
  EXPECT_THAT(text, HasSubstr("640 x 480"));
  EXPECT_THAT(text, HasSubstr("512 x 512"));
}

TEST(Difference, BandsMatchByWavelengthWhateverTheDigits) {
  const Image test = grey(3, 3, 2.0f, "S0.400nm"), reference = grey(3, 3, 1.0f, "S0.400,000000nm");
  const DifferenceMap map = difference_map(test, reference);
  ASSERT_EQ(map.channels.size(), 1u);
  EXPECT_EQ(map.channels[0].wavelength_nm, 400.0);
  EXPECT_EQ(map.channels[0].difference[4], 1.0f);
}

TEST(Difference, OtherBandsOrChannelsAreRefusedWithBothSaid) {
  const Image b400 = grey(3, 3, 1, "S0.400,0nm"), b410 = grey(3, 3, 1, "S0.410,0nm");
  EXPECT_THAT(mismatch_text([&] { difference_map(b410, b400); }),
              testing::AllOf(HasSubstr("400"), HasSubstr("410")));
  EXPECT_THAT(mismatch_text([&] { difference_map(grey(3, 3, 1, "A"), grey(3, 3, 1, "Y")); }),
              testing::AllOf(HasSubstr("channels A"), HasSubstr("has Y")));
}

TEST(Difference, OtherUnitsAreRefused) {
  Image test = grey(3, 3, 1), reference = grey(3, 3, 1);
  test.attributes["unit"] = "DN";
  reference.attributes["unit"] = "W m^-2 sr^-1 nm^-1";
  EXPECT_THAT(mismatch_text([&] { difference_map(test, reference); }), HasSubstr("DN"));
}

}  // namespace
}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "difference/limits.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

namespace truebox {
namespace {

Image plane(std::vector<float> values) {
  Image image(static_cast<int>(values.size()), 1);
  image.channels.push_back({"Y", std::move(values)});
  return image;
}

TEST(Statistics, FollowTheirDefinitions) {
  const auto map = difference_map(plane({1.5f, 1.0f, 0.0f, 2.0f}), plane({1.0f, 2.0f, 0.0f, 2.0f}));
  const DifferenceStatistics s = difference_statistics(map);  // d = 0.5, -1, 0, 0; mean ref 1.25
  EXPECT_DOUBLE_EQ(s.smape, (2 * 0.5 / 2.5 + 2 * 1.0 / 3.0) / 4);
  const double e = 0.01 * 1.25 * 1.25;
  EXPECT_DOUBLE_EQ(s.relative_mse, (0.25 / (1 + e) + 1.0 / (4 + e)) / 4);
  EXPECT_NEAR(s.psnr_db, 10 * std::log10(4.0 / (1.25 / 4)), 1e-12);
  EXPECT_DOUBLE_EQ(channel_statistics(map, 0).rms, s.rms);
  EXPECT_THROW(channel_statistics(map, 1), std::invalid_argument);
  const auto same = difference_map(plane({1, 2}), plane({1, 2}));
  EXPECT_EQ(difference_statistics(same).psnr_db, std::numeric_limits<double>::infinity());
}

TEST(Limit, ReadsWhatItsHeaderSays) {
  const Limit limit = parse_limit("ciede2000:1:2.5:0.1%");
  EXPECT_EQ(limit.quantity, "ciede2000");
  EXPECT_EQ(limit.warn, 1.0);
  EXPECT_EQ(limit.fail, 2.5);
  EXPECT_DOUBLE_EQ(limit.allowed_fraction, 0.001);
  EXPECT_EQ(parse_limit("relative:2%:5%").fail, 0.05);
  for (const char* bad : {"", "relative", "relative:1", "relative:2:1", "relative:a:b",
                          "relative:-1:2", "nonsense:1:2", "nonsense-mean:1:2", "relative:1:2:3",
                          "rmse:1:2:0.1", "rmse:1:nan", "relative:1:2:0.1:0", "relative::1"})
    EXPECT_THROW(parse_limit(bad), std::invalid_argument) << bad;
}

LimitResult applied(const char* text, const DifferenceMap& map,
                    const std::vector<MetricMap>& metrics = {}) {
  return apply_limit(parse_limit(text), map, difference_statistics(map), metrics);
}

TEST(Limit, PercentIsRelativeTimesAHundred) {
  const auto map = difference_map(plane({1.03f, 1.0f}), plane({1.0f, 1.0f}));
  EXPECT_EQ(applied("percent:2:5", map).outcome, Agreement::warning);
  EXPECT_EQ(applied("relative:0.02:0.05", map).outcome, Agreement::warning);
  EXPECT_EQ(applied("percent:4:5", map).outcome, Agreement::agrees);
  EXPECT_EQ(applied("percent:1:2", map).outcome, Agreement::fails);
  EXPECT_EQ(applied("percent:1:2:0.5", map).outcome, Agreement::agrees);
  EXPECT_NEAR(applied("percent:2:5", map).measured, 3.0, 1e-4);
}

TEST(Limit, OfTheWholeHasNoSign) {
  const auto map = difference_map(plane({0.5f, 1.0f}), plane({1.0f, 1.0f}));
  EXPECT_EQ(applied("bias:0.2:0.3", map).outcome, Agreement::warning);
  EXPECT_DOUBLE_EQ(applied("bias:0.2:0.3", map).measured, 0.25);
  EXPECT_EQ(applied("rmse:0.1:0.2", map).outcome, Agreement::fails);
}

TEST(Limit, WhatIsNoNumberNeverPasses) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto map = difference_map(plane({nan, 1.0f}), plane({1.0f, 1.0f}));
  for (const char* text : {"absolute:9:9:1", "percent:9:9:1", "rmse:9:9", "smape:9:9"})
    EXPECT_EQ(applied(text, map).outcome, Agreement::fails) << text;
  const MetricMap flip{"flip", "FLIP", "1", 2, 1, {nan, 0.0f}};
  EXPECT_EQ(applied("flip:1:1:1", map, {flip}).outcome, Agreement::fails);
  EXPECT_EQ(applied("flip-mean:1:1", map, {flip}).outcome, Agreement::fails);
}

TEST(Limit, OnAMetricCountsItsPixels) {
  const auto map = difference_map(plane({1, 1, 1, 1}), plane({1, 1, 1, 1}));
  const MetricMap flip{"flip", "FLIP", "1", 4, 1, {0.0f, 0.1f, 0.2f, 0.5f}};
  const LimitResult r = applied("flip:0.15:0.3:0.25", map, {flip});
  EXPECT_EQ(r.outcome, Agreement::warning);
  EXPECT_EQ(r.beyond_warn, 2u);
  EXPECT_EQ(r.beyond_fail, 1u);
  EXPECT_EQ(r.at.x_px, 3);
  EXPECT_EQ(applied("flip-mean:0.1:0.3", map, {flip}).outcome, Agreement::warning);
  EXPECT_THROW(applied("flip:1:1", map), std::invalid_argument);
}

}  // namespace
}  // namespace truebox

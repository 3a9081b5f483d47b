// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <regex>

#include "figures/line_plot.h"
#include "figures/score_plot.h"
#include "figures/text.h"

namespace truebox {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::vector<std::string> texts(const std::string& svg) {
  std::vector<std::string> found;
  const std::regex text("<text[^>]*>([^<]*)</text>");
  for (std::sregex_iterator it(svg.begin(), svg.end(), text), end; it != end; ++it)
    found.push_back((*it)[1]);
  return found;
}

TEST(ScaleBar, SaysTheRangeOfTheDataAndItsUnit) {
  const std::vector<float> values = {0.25f, 1.5f, 2.75f, 0.5f};
  const ValueRange range = value_range(values);
  EXPECT_EQ(range.low, 0.25);
  EXPECT_EQ(range.high, 2.75);
  const Picture picture = false_colour(2, 2, values, range, "radiance", "W m^-2 sr^-1 nm^-1");
  EXPECT_THAT(texts(picture.scale_bar_svg),
              ElementsAre("0.250", "1.50", "2.75", "radiance / W m⁻² sr⁻¹ nm⁻¹"));
  EXPECT_EQ(picture.note, "");
}

TEST(ScaleBar, TellsNarrowRangesApart) {
  const std::vector<float> values = {1000.0f, 1001.0f};
  const auto labels = texts(false_colour(2, 1, values, {1000, 1001}, "DN", "1").scale_bar_svg);
  EXPECT_THAT(labels, ElementsAre("1000.00", "1000.50", "1001.00", "DN"));
}

TEST(ScaleBar, IsSymmetricForSignedPictures) {
  const std::vector<float> values = {-3.0f, 1.0f};
  const auto labels = texts(
      signed_false_colour(2, 1, values, symmetric_limit(values), "difference", "1").scale_bar_svg);
  EXPECT_THAT(labels, ElementsAre("-3.00", "0", "3.00", "difference"));
}

TEST(FalseColour, CountsWhatLiesBeyondTheScale) {
  const std::vector<float> values = {-1.0f, 0.5f, 2.0f, std::numeric_limits<float>::quiet_NaN()};
  EXPECT_EQ(
      false_colour(2, 2, values, {0, 1}, "q", "1").note,
      "1 of 4 pixels above the scale; 1 of 4 pixels below the scale; 1 of 4 pixels not finite "
      "(magenta)");
  EXPECT_THROW(false_colour(2, 1, values, {0, 1}, "q", "1"), std::invalid_argument);
}

TEST(LinePlot, PutsPointsWhereTheirNumbersSay) {
  LinePlot plot{
      "t", {"x", "nm", false, ValueRange{0, 10}}, {"y", "1", false, ValueRange{0, 1}}, {}};
  plot.series = {{"points", {5}, {0.5}, {0.1}, {1}, false, true}};
  const std::string svg = to_svg(plot);
  EXPECT_THAT(svg,
              HasSubstr("<circle cx=\"261.00\" cy=\"149.00\""));  // the middle of 64..458, 270..28
  EXPECT_THAT(svg, HasSubstr("M221.60 149.00H300.40"));           // 5 +- 1 nm
  EXPECT_THAT(svg, HasSubstr("M261.00 173.20V124.80"));           // 0.5 +- 0.1
  EXPECT_THAT(texts(svg), testing::IsSupersetOf({"x / nm", "y", "points"}));
}

TEST(LinePlot, DrawsLawsInNoColourOfASeriesAndEachInADashOfItsOwn) {
  LinePlot plot{"t", {"x", ""}, {"y", ""}, {}};
  for (int k = 0; k < 9; ++k) {
    plot.series.push_back({std::to_string(k), {0, 1}, {0, 1.0 + k}});
    plot.series.back().dashed = k == 2 || k > 6;
  }
  const std::string svg = to_svg(plot);
  const auto count = [&](const std::string& text) {
    int n = 0;
    for (std::size_t at = svg.find(text); at != std::string::npos; at = svg.find(text, at + 1)) ++n;
    return n;
  };
  for (int k = 0; k < 6; ++k)
    EXPECT_EQ(count("--series-" + std::to_string(k)), 4) << "curve and legend, stroke and fill";
  for (const char* dash : {"\"6 5\"", "\"2 4\"", "\"11 4 2 4\""}) EXPECT_EQ(count(dash), 2) << dash;
}

TEST(LinePlot, BreaksALineWhereThereIsNoNumber) {
  LinePlot plot{"t", {"x", ""}, {"y", ""}, {}};
  plot.series = {{"s", {1, 2, 3, 4, 5}, {1, 2, std::numeric_limits<double>::quiet_NaN(), 2, 1}}};
  const std::string svg = to_svg(plot);
  EXPECT_THAT(svg, testing::Not(HasSubstr("nan")));
  const std::regex broken("d=\"M[^M\"]*L[^M\"]*M[^M\"]*L[^M\"]*\"");
  EXPECT_TRUE(std::regex_search(svg, broken));
}

TEST(LinePlot, LogarithmicAxesAreLabelledInDecades) {
  LinePlot plot{"t", {"patches", "1", true}, {"error", "1", true}, {}};
  plot.series = {{"s", {10, 100000}, {0.1, 0.00001}}};
  EXPECT_THAT(texts(to_svg(plot)), testing::IsSupersetOf({"10²", "10⁵", "10⁻⁵", "10⁻¹"}));
  plot.series[0].u_y = {1};
  EXPECT_THROW(to_svg(plot), std::invalid_argument);
}

TEST(EnScores, MarksThoseBeyondOneAndThoseThatAreNoNumber) {
  const auto crosses = [](double value) {
    const std::string svg = en_score_svg("t", {{"a", value}});
    return svg.find("✕") != std::string::npos;
  };
  EXPECT_FALSE(crosses(0.99));
  EXPECT_TRUE(crosses(1.01));
  EXPECT_TRUE(crosses(-1.01));
  EXPECT_TRUE(crosses(std::numeric_limits<double>::quiet_NaN()));
}

TEST(ZHistogram, SaysMeanSpreadAndWhatIsNoNumber) {
  const std::vector<double> z = {-1, 1, std::numeric_limits<double>::quiet_NaN()};
  EXPECT_THAT(z_histogram_svg("t", z),
              HasSubstr("n = 2, mean 0.00, standard deviation 1.41, 1 not finite"));
}

TEST(NumberText, KeepsTheDigitsThatAreKnown) {
  EXPECT_EQ(number_text(0.5, 4), "0.5000");
  EXPECT_EQ(number_text(1234.5, 3), "1234");  // ties to even in binary: 1234.5 is exact
  EXPECT_EQ(number_text(9.9996, 4), "10.00");
  EXPECT_EQ(number_text(1.2e-7, 2), "1.2 × 10⁻⁷");
  EXPECT_EQ(number_text(std::numeric_limits<double>::quiet_NaN()), "NaN");
  EXPECT_EQ(number_text(-std::numeric_limits<double>::infinity()), "-∞");
  EXPECT_EQ(estimate_text(0.512345, 0.00123), "0.5123 ± 0.0012");
  EXPECT_EQ(fixed_text(-0.001, 2), "0.00");
}

TEST(ValidText, ReplacesWhatIsNoUtf8OrNoXml) {
  EXPECT_EQ(valid_text("a\xff"
                       "b\x01"
                       "c"),
            "a\uFFFDb\uFFFDc");
  EXPECT_EQ(valid_text("\xC0\xAF"), "\uFFFD\uFFFD");  // an overlong '/'
  EXPECT_EQ(valid_text("µ √ 😀\n"), "µ √ 😀\n");
}

}  // namespace
}  // namespace truebox

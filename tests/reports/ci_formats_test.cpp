// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <limits>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "document/writers.h"
#include "support/json_schema.h"

namespace truebox {
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Report sample() {
  Report report;
  report.title = "box, 100 %: \"test\"";
  report.verdict = {Agreement::fails, "It differs:\nby 2."};
  report.key_numbers = {{"largest", 2.0, "W m^-2", 3, "k = 2"}};
  report.sections = {{"One", {Paragraph{"text"}}}};
  report.checks = {{"good", Agreement::agrees, 0.5, 1.0, "1", "fine"},
                   {"near", Agreement::warning, 0.9, 0.8, "W m^-2", "close"},
                   {"bad, worse", Agreement::fails, kNaN, 1.0, "", "a\nb % c"}};
  report.provenance = {{"Test", "box.exr"}};
  return report;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

TEST(Annotations, AreOneLineEachAndEscaped) {
  const auto lines = lines_of(to_annotations(sample()));
  ASSERT_EQ(lines.size(), 3u);
  EXPECT_EQ(lines[0],
            "::warning title=box%2C 100 %25%3A \"test\"%3A near::measured 0.9 W m^-2, limit 0.8. "
            "close");
  EXPECT_THAT(lines[1], testing::StartsWith("::error title="));
  EXPECT_THAT(lines[1], HasSubstr("a%0Ab %25 c"));
  EXPECT_EQ(lines[2].rfind("::notice title=", 0), 0u);
  Report many = sample();
  many.checks.assign(500, many.checks[2]);
  EXPECT_EQ(lines_of(to_annotations(many)).size(), 11u);
}

TEST(Badge, IsWhatShieldsExpects) {
  for (const auto& [outcome, colour] : {std::pair{Agreement::agrees, "brightgreen"},
                                        {Agreement::warning, "yellow"},
                                        {Agreement::fails, "red"},
                                        {Agreement::not_run, "red"}}) {
    Report report = sample();
    report.verdict.outcome = outcome;
    const auto badge = nlohmann::json::parse(to_badge(report));
    EXPECT_EQ(badge["schemaVersion"], 1);
    EXPECT_EQ(badge["label"], "truebox");
    EXPECT_EQ(badge["message"], to_text(outcome));
    EXPECT_EQ(badge["color"], colour);
  }
}

TEST(OpenMetrics, FollowsTheTextFormat) {
  Report report = sample();
  report.checks.push_back(report.checks[0]);  // the same labels twice would be refused
  const auto lines = lines_of(to_openmetrics(report));
  EXPECT_EQ(lines.back(), "# EOF");
  const std::regex comment("# (TYPE|HELP) [a-z_]+ .+");
  const std::regex sample_line(
      R"re([a-z_]+\{[a-z]+="(\\.|[^"\\])*"(,[a-z]+="(\\.|[^"\\])*")*\} (NaN|[+-]Inf|-?[0-9.e+-]+))re");
  std::vector<std::string> samples;
  for (std::size_t i = 0; i + 1 < lines.size(); ++i) {
    if (std::regex_match(lines[i], comment)) continue;
    EXPECT_TRUE(std::regex_match(lines[i], sample_line)) << lines[i];
    samples.push_back(lines[i].substr(0, lines[i].rfind(' ')));
  }
  EXPECT_EQ(samples.size(), 3u * 3u + 1u);
  std::sort(samples.begin(), samples.end());
  EXPECT_EQ(std::adjacent_find(samples.begin(), samples.end()), samples.end());
}

TEST(JUnit, CarriesPropertiesAndAttachesThePageToFailures) {
  const std::string xml = to_junit(sample(), {"out/report.html"});
  EXPECT_THAT(xml, HasSubstr("<property name=\"verdict\" value=\"fails\"/>"));
  EXPECT_THAT(xml, HasSubstr("<property name=\"largest\" value=\"2 W m^-2\"/>"));
  EXPECT_THAT(xml, HasSubstr("<property name=\"Test\" value=\"box.exr\"/>"));
  const std::string mark = "[[ATTACHMENT|out/report.html]]";
  const std::size_t at = xml.find(mark);
  ASSERT_NE(at, std::string::npos);
  EXPECT_EQ(xml.find(mark, at + 1), std::string::npos);  // only the one that fails
  EXPECT_GT(at, xml.find("name=\"bad, worse\""));
}

TEST(Trend, RemembersEveryEarlierRun) {
  Report first = sample(), second = sample(), third = sample();
  second.checks[0].measured = 0.6;
  third.checks[0].measured = 0.7;
  third.checks[1].name = "new";
  add_trend(second, from_json(to_json(first), "first"));
  add_trend(third, from_json(to_json(second), "second"));
  EXPECT_THAT(third.checks[0].earlier, testing::ElementsAre(0.5, 0.6));
  EXPECT_TRUE(third.checks[1].earlier.empty());
  const std::string html = to_html(third);
  EXPECT_THAT(html, HasSubstr("Since the baseline"));
  EXPECT_THAT(html, HasSubstr("Not in the earlier run: new."));
  EXPECT_THAT(html, HasSubstr("Only in the earlier run: near."));
  EXPECT_THAT(html, HasSubstr("Measured over limit, run by run"));
  EXPECT_EQ(to_html(from_json(to_json(third), "third")), html);
}

TEST(Trend, KeepsTheLastFifty) {
  Report report = sample();
  for (int run = 0; run < 60; ++run) {
    Report next = sample();
    next.checks[0].measured = run;
    add_trend(next, report);
    report = next;
  }
  ASSERT_EQ(report.checks[0].earlier.size(), 50u);
  EXPECT_EQ(report.checks[0].earlier.back(), 58.0);
}

TEST(Schema, AcceptsWhatIsWrittenAndRefusesTheRest) {
  if (!has_schema_validator()) GTEST_SKIP() << "python3-jsonschema is not installed";
  Report report = sample();
  Table table{"numbers", {{"name"}, {"value", "nm", 2, true}}, {}};
  table.rows = {{"a", Cell(1.0 / 3.0, 0.01)}, {"b", Cell(kNaN, Agreement::warning)}};
  const std::vector<float> values = {0.0f, 1.0f, 2.0f, 3.0f};
  report.sections.push_back(
      {"Two",
       {table, Figure{"none", "", ""},
        PictureRow{{{"Picture", false_colour(2, 2, values, {0, 3}, "L", "1"), "alt"}}, "c"}}});
  add_trend(report, sample());
  const std::string json = to_json(report);
  EXPECT_EQ(schema_objection("report.schema.json", json), std::nullopt);
  auto broken = nlohmann::json::parse(json);
  const auto refused = [&](auto change) {
    auto copy = broken;
    change(copy);
    return schema_objection("report.schema.json", copy.dump()).has_value();
  };
  EXPECT_TRUE(refused([](auto& j) { j.erase("verdict"); }));
  EXPECT_TRUE(refused([](auto& j) { j["verdict"]["outcome"] = "perhaps"; }));
  EXPECT_TRUE(refused([](auto& j) { j["checks"][0]["measured"] = "many"; }));
  EXPECT_TRUE(refused([](auto& j) { j["sections"][0]["blocks"][0]["kind"] = "film"; }));
  EXPECT_TRUE(refused([](auto& j) { j["extra"] = 1; }));
  EXPECT_TRUE(refused([](auto& j) { j["truebox_report"] = 2; }));
}

}  // namespace
}  // namespace truebox

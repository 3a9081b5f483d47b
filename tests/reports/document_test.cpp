// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>
#include <regex>

#include "document/writers.h"
#include "figures/score_plot.h"
#include "radiometry/input_error.h"
#include "support/scratch.h"

namespace truebox {
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr const char* kHostile = "<script>alert('x')</script>\" onload=\"y & \xff\x02";

Report sample() {
  const std::vector<float> values = {0.0f, 1.0f, 2.0f, 3.0f};
  Report report;
  report.title = "A & B";
  report.subtitle = "simulated";
  report.verdict = {Agreement::fails, "1 of 2 checks fails: 1.25 against 1."};
  report.key_numbers = {{"largest", 0.1 + 0.2, "W m^-2", 3, "k = 2"},
                        {"nothing", std::numeric_limits<double>::quiet_NaN()}};
  Table table{"numbers", {{"name"}, {"value", "nm", 2, true}}, {}};
  table.rows = {{"a", Cell(1.0 / 3.0, 0.01)}, {"b", Cell(2.5, Agreement::warning)}};
  Picture picture = false_colour(2, 2, values, {0, 3}, "radiance", "W m^-2 sr^-1");
  report.sections = {
      {"One",
       {Paragraph{"text"}, table, Figure{"E_n", en_score_svg("E_n", {{"p", 0.5}}), "c"},
        PictureRow{{{"Photograph", picture, "alt text"}}, "caption"}}},
      {"Two", {}}};
  report.checks = {{"good", Agreement::agrees, 0.5, 1.0, "1", ""},
                   {"bad", Agreement::fails, 1.25, 1.0, "1", "too large"}};
  report.provenance = {{"source", "https://example.org/data"}};
  return report;
}

Report hostile() {
  Report report = sample();
  report.title = report.subtitle = report.verdict.sentence = kHostile;
  report.key_numbers[0].label = report.key_numbers[0].note = report.key_numbers[0].unit = kHostile;
  report.checks[0].name = report.checks[0].message = report.checks[0].unit = kHostile;
  report.provenance[0] = {kHostile, kHostile};
  report.sections[0].title = kHostile;
  auto& blocks = report.sections[0].blocks;
  std::get<Paragraph>(blocks[0]).text = kHostile;
  std::get<Table>(blocks[1]).rows[0][0].text = kHostile;
  std::get<Table>(blocks[1]).columns[1].unit = kHostile;
  std::get<Figure>(blocks[2]).svg = en_score_svg(kHostile, {{kHostile, 0.5}});
  auto& panel = std::get<PictureRow>(blocks[3]).panels[0];
  panel.title = panel.alt = panel.picture.note = kHostile;
  return report;
}

/// Well-formedness of XML without entities or CDATA: tags nest and close, & starts an entity.
bool is_well_formed(const std::string& xml) {
  std::vector<std::string> open;
  const std::regex tag("<(/?)([A-Za-z:-]+)((?:\\s+[A-Za-z:-]+=\"[^\"<]*\")*)\\s*(/?)>");
  const std::regex reference("&(?!(amp|lt|gt|quot|#39);)");
  if (std::regex_search(xml, reference)) return false;
  std::string rest = xml.substr(xml.find("?>") + 2);
  std::smatch m;
  while (std::regex_search(rest, m, tag)) {
    if (m.prefix().str().find('<') != std::string::npos) return false;
    if (m[1] == "/") {
      if (open.empty() || open.back() != m[2]) return false;
      open.pop_back();
    } else if (m[4] != "/") {
      open.push_back(m[2]);
    }
    rest = m.suffix();
  }
  return open.empty() && rest.find('<') == std::string::npos;
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (std::size_t at = text.find(part); at != text.npos; at = text.find(part, at + 1)) ++n;
  return n;
}

TEST(Html, EscapesHostileText) {
  const std::string html = to_html(hostile());
  EXPECT_THAT(html, Not(HasSubstr("<script>alert")));
  EXPECT_THAT(html, Not(HasSubstr("\" onload=")));
  EXPECT_THAT(html, HasSubstr("&lt;script&gt;alert"));
  EXPECT_EQ(count(html, "<script>"), 1u);  // the page's own
  EXPECT_EQ(html.find('\xff'), std::string::npos);
}

TEST(Html, AsksForNothingFromOutside) {
  const std::string html = to_html(sample());
  const std::regex source("(src|href|srcset|action|data)\\s*=\\s*\"([^\"]*)\"");
  int found = 0;
  for (std::sregex_iterator it(html.begin(), html.end(), source), end; it != end; ++it, ++found) {
    const std::string target = (*it)[2];
    EXPECT_TRUE(target.starts_with("data:image/png;base64,") || target.starts_with("#")) << target;
  }
  EXPECT_GE(found, 4);  // one picture, the skip link, two or more entries of the contents
  EXPECT_THAT(html, Not(HasSubstr("@import")));
  EXPECT_THAT(html, Not(HasSubstr("url(")));
}

TEST(Html, HasWhatAReaderNeeds) {
  const std::string html = to_html(sample());
  for (const char* part : {"<html lang=\"en\">", "<title>fails: A &amp; B</title>",
                           "alt=\"alt text\"", "<th scope=\"col\"", "<th scope=\"row\"", "W m⁻²",
                           "0.333 ± 0.010", "<details open>", "name=\"viewport\"", "0.300", "NaN"})
    EXPECT_THAT(html, HasSubstr(part));
  EXPECT_EQ(count(html, "<h1>"), 1u);
  EXPECT_LT(html.find("1 of 2 checks fails"), html.find("<h2>"));  // the verdict comes first
}

TEST(Html, RefusesFiguresThatAreMoreThanDrawings) {
  for (const char* svg :
       {"<svg viewBox=\"0 0 1 1\"><script>x</script></svg>", "<svg onload=\"x\"></svg>",
        "<svg viewBox=\"0 0 1 1\"><rect style=\"fill:url(//x)\"/></svg>", "<svg ><image/></svg>",
        "<svg ><text>a</text></svg><p>b</p>", "<svg ><g></svg>", "<b>x</b>", "<svg ",
        "<svg ><text href=\"#\">a</text></svg>"}) {
    Report report = sample();
    std::get<Figure>(report.sections[0].blocks[2]).svg = svg;
    EXPECT_THROW(to_html(report), std::invalid_argument) << svg;
    EXPECT_THROW(from_json(to_json(report), "r.json"), InputError) << svg;
  }
}

TEST(Html, RefusesRaggedTables) {
  Report report = sample();
  std::get<Table>(report.sections[0].blocks[1]).rows[0].pop_back();
  EXPECT_THROW(to_html(report), std::invalid_argument);
}

TEST(Json, GivesTheSamePageAgain) {
  for (const Report& report : {sample(), hostile(), Report{}}) {
    const std::string json = to_json(report);
    const Report again = from_json(json, "r.json");
    EXPECT_EQ(to_html(again), to_html(report));
    EXPECT_EQ(to_json(again), json);
  }
  EXPECT_EQ(from_json(to_json(sample()), "r.json").key_numbers[0].value, 0.1 + 0.2);  // every bit
}

TEST(Json, MalformedInputNamesFileAndLine) {
  try {
    from_json("{\n\"truebox_report\": 1,\n oops }", "run.json");
    FAIL() << "read nonsense";
  } catch (const InputError& error) {
    EXPECT_EQ(error.file(), "run.json");
    EXPECT_EQ(error.line(), 3);
  }
  std::string json = to_json(sample());
  EXPECT_THROW(from_json(json.substr(0, json.size() / 2), "f"), InputError);
  EXPECT_THROW(from_json("[]", "f"), InputError);
  EXPECT_THROW(from_json("{}", "f"), InputError);
  const auto replaced = [&](const std::string& from, const std::string& to) {
    std::string other = json;
    other.replace(other.find(from), from.size(), to);
    return other;
  };
  EXPECT_THROW(from_json(replaced("\"truebox_report\": 1", "\"truebox_report\": 2"), "f"),
               InputError);
  EXPECT_THROW(from_json(replaced("\"fails\"", "\"great\""), "f"), InputError);
  EXPECT_THROW(from_json(replaced("iVBORw0KGgo", "aVBORw0KGgo"), "f"), InputError);
}

TEST(Junit, IsWellFormedAndCountsFailures) {
  for (const Report& report : {sample(), hostile()}) {
    const std::string xml = to_junit(report);
    EXPECT_TRUE(is_well_formed(xml)) << xml;
    EXPECT_THAT(xml, HasSubstr("tests=\"2\" failures=\"1\""));
    EXPECT_EQ(count(xml, "<failure "), 1u);
    EXPECT_THAT(xml, HasSubstr("<property name=\"measured\" value=\"1.25\"/>"));
  }
  EXPECT_FALSE(is_well_formed("<?xml?><a><b></a>"));  // the helper can fail
  EXPECT_FALSE(is_well_formed("<?xml?><a>&</a>"));
}

TEST(Junit, AWarningPassesAndAnUnrunCheckDoesNot) {
  Report report;
  report.checks = {{"w", Agreement::warning, 2, 1}, {"n", Agreement::not_run}};
  EXPECT_THAT(to_junit(report), HasSubstr("tests=\"2\" failures=\"1\""));
}

TEST(Markdown, StaysBelowTheLimitAndShowsTheWorstFirst) {
  Report report = sample();
  for (int i = 0; i < 50000; ++i)
    report.checks.push_back({"check " + std::to_string(i), Agreement::agrees, 0.0, 1.0});
  const std::string md = to_markdown(report);
  EXPECT_LT(md.size(), std::size_t{1} << 20);
  EXPECT_THAT(md, HasSubstr("more checks are in report.html"));
  EXPECT_LT(md.find("| bad |"), md.find("| good |"));
  EXPECT_THAT(to_markdown(hostile()), Not(HasSubstr("<script>")));
}

TEST(WorstOutcome, NothingCheckedIsNothingShown) {
  EXPECT_EQ(worst_outcome({}), Agreement::not_run);
  EXPECT_EQ(exit_code(Agreement::not_run), 2);
  EXPECT_EQ(worst_outcome(sample().checks), Agreement::fails);
  EXPECT_EQ(exit_code(worst_outcome({{"w", Agreement::warning}})), 1);
  EXPECT_EQ(exit_code(worst_outcome({{"a", Agreement::agrees}})), 0);
}

TEST(WriteReport, LeavesItsFilesAndNothingElse) {
  const auto directory = std::filesystem::path(scratch_path("write_report"));
  std::filesystem::remove_all(directory);
  write_report(directory, sample());
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(directory))
    names.push_back(entry.path().filename().string());
  EXPECT_THAT(names, testing::UnorderedElementsAre("report.html", "report.json", "junit.xml",
                                                   "summary.md", "badge.json", "metrics.txt"));
  std::filesystem::remove_all(directory);
}

}  // namespace
}  // namespace truebox

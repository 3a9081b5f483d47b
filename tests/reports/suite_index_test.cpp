// SPDX-License-Identifier: BSD-3-Clause
#include "document/suite_index.h"

#include <gmock/gmock.h>

namespace truebox {
namespace {

using testing::HasSubstr;
using testing::Not;

SuiteEntry entry(const std::string& name, Agreement outcome, double nearness) {
  return {name, outcome, "says " + name, name + "/report.html", {"tag-" + name}, {}, nearness};
}

TEST(SuiteIndex, ShowsTheWorstFirst) {
  const std::string html = to_suite_html(
      "Suite", {Agreement::fails, "2 of 4 agree"},
      {entry("fine", Agreement::agrees, 0.1), entry("near", Agreement::agrees, 0.9),
       entry("broken", Agreement::not_run, 0.0), entry("off", Agreement::fails, 3.0)});
  const auto at = [&](const char* name) {
    return html.find("data-name=\"" + std::string(name) + "\"");
  };
  EXPECT_LT(at("broken"), at("off"));
  EXPECT_LT(at("off"), at("near"));
  EXPECT_LT(at("near"), at("fine"));
  EXPECT_THAT(html, HasSubstr("<option value=\"tag-near\">"));
  EXPECT_THAT(html, HasSubstr("agrees (2)"));
  EXPECT_THAT(html, HasSubstr("href=\"off/report.html\""));
}

TEST(SuiteIndex, EscapesEveryTextAndAsksForNothing) {
  const std::string hostile = "<script>alert(1)</script>\" onload=\"x & \xff";
  SuiteEntry bad = entry("x", Agreement::fails, 1.0);
  bad.name = bad.sentence = hostile;
  bad.tags = {hostile};
  bad.thumbnails = {{hostile, plain_picture(1, 1, {1, 2, 3}, ""), hostile}};
  const std::string html = to_suite_html(hostile, {Agreement::fails, hostile}, {bad});
  EXPECT_THAT(html, Not(HasSubstr("<script>alert")));
  EXPECT_THAT(html, Not(HasSubstr("\" onload=")));
  EXPECT_EQ(html.find('\xff'), std::string::npos);
  EXPECT_THAT(html, HasSubstr("default-src 'none'"));
  EXPECT_THAT(html, Not(HasSubstr("http://")));
  EXPECT_THAT(html, Not(HasSubstr("https://")));
}

TEST(SuiteIndex, SaysWhyThereIsNoReport) {
  SuiteEntry none = entry("gone", Agreement::not_run, 0.0);
  none.page.clear();
  none.sentence = "gone.exr: expected an image, found no such file";
  const std::string html = to_suite_html("S", {Agreement::not_run, ""}, {none});
  EXPECT_THAT(html, HasSubstr("<h2>gone</h2>"));
  EXPECT_THAT(html, HasSubstr("found no such file"));
}

}  // namespace
}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "support/chromium.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "support/scratch.h"

namespace truebox {
namespace {

std::string page_file(const char* name, const std::string& text) {
  const std::string path = scratch_path(name);
  std::ofstream(path) << text;
  return path;
}

TEST(Chromium, ReadsClicksTypesAndComplains) {
  if (Chromium::program().empty()) GTEST_SKIP() << "no Chromium here";
  Chromium browser(400, 300);
  browser.open(page_file("good.html",
                         "<!DOCTYPE html><title>good</title><body style='margin:0'>"
                         "<button style='position:absolute;left:100px;top:50px;width:80px;"
                         "height:40px' onclick='this.textContent=++n'>0</button>"
                         "<script>let n = 0;</script>"));
  EXPECT_EQ(browser.evaluate("document.title"), "\"good\"");
  EXPECT_EQ(browser.evaluate("Promise.resolve(1 + 2)"), "3");
  browser.click(140, 70);
  browser.press(" ");  // the button has the focus now
  browser.click(20, 20);
  EXPECT_EQ(browser.evaluate("document.querySelector('button').textContent"), "\"2\"");
  EXPECT_THROW(browser.evaluate("nothing.here"), std::runtime_error);
  EXPECT_THAT(browser.complaints(), testing::IsEmpty());

  browser.open(page_file("bad.html",
                         "<!DOCTYPE html><img src='http://127.0.0.1:9/x.png'>"
                         "<script>console.error('oh'); setTimeout(() => missing(), 0);</script>"));
  browser.wait_until("document.images[0].complete");
  EXPECT_THAT(browser.complaints(),
              testing::AllOf(testing::Contains(testing::HasSubstr("console: ")),
                             testing::Contains(testing::HasSubstr("missing is not defined")),
                             testing::Contains(testing::StartsWith("request: http://127.0.0.1"))));
}

}  // namespace
}  // namespace truebox

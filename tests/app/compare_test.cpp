// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>

#include "image/image_file.h"
#include "image/spectral_image.h"
#include "support/json_schema.h"
#include "support/run_command.h"

namespace truebox {
namespace {

using testing::HasSubstr;
using testing::Not;
namespace fs = std::filesystem;

using Outcome = CommandOutcome;

Outcome run(const std::string& arguments) {
  return run_command("TRUEBOX_REFERENCE='" TRUEBOX_REFERENCE_DIR "' '" TRUEBOX_PROGRAM "' " +
                     arguments);
}

std::string text_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Files of images with three bands: radiance rising to the right, noise on request.
class Compare : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = scratch_path(testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(folder_);
    save("reference.exr", image(0.0f, 0));
  }
  std::string file(const std::string& name) const { return (folder_ / name).string(); }
  void save(const std::string& name, const Image& image) const { write_exr(file(name), image); }
  static Image image(float noise, unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<float> draw(0.0f, 1.0f);
    Image result(32, 24);
    result.attributes["unit"] = "W m^-2 sr^-1 nm^-1";
    for (double nm : {450.0, 550.0, 650.0}) {
      Channel& band = result.add_channel(spectral_channel_name(nm));
      for (std::size_t i = 0; i < band.samples.size(); ++i)
        band.samples[i] = 1.0f + 0.05f * static_cast<float>(i % 32) + noise * draw(random);
    }
    return result;
  }
  static Image plane(float value, const std::vector<double>& bands = {450.0, 550.0, 650.0}) {
    Image result(32, 24);
    for (double nm : bands) result.add_channel(spectral_channel_name(nm), value);
    return result;
  }
  std::string pair() const { return file("test.exr") + " " + file("reference.exr"); }

  fs::path folder_;
};

TEST_F(Compare, SaysHowFarFromTheLimit) {
  Image test = image(0.0f, 0);
  test.channels[1].samples[test.index(4, 5)] *= 1.03f;
  save("test.exr", test);
  const Outcome agrees = run("compare " + pair() + " --percent --fail 6");
  EXPECT_EQ(agrees.code, 0) << agrees.text;
  EXPECT_THAT(agrees.text, HasSubstr("3.000 % at pixel (4, 5)"));
  EXPECT_THAT(agrees.text, HasSubstr("50 % of the limit 6"));
  EXPECT_EQ(run("compare " + pair() + " --relative --warn 0.02 --fail 0.05").code, 1);
  EXPECT_EQ(run("compare " + pair() + " --limit relative:1%:2%").code, 2);
  EXPECT_EQ(run("compare " + pair() + " --limit relative:1%:2%:0.2%").code, 0);
  EXPECT_EQ(run("compare " + pair() + " --limit rmse:1:2 --limit angle:0.1:0.2").code, 2);
  EXPECT_EQ(run("compare " + pair() + " --limit flip-mean:0.5:1").code, 0);
}

TEST_F(Compare, WrongLimitsAre64AndLimitsThatDoNotFitAre3) {
  save("test.exr", image(0.0f, 0));
  for (const char* options :
       {"--limit relative", "--limit beauty:1:2", "--limit relative:2:1", "--statistical",
        "--relative --percent", "--variance x.exr", "--observer 1776", "--region floor"})
    EXPECT_EQ(run("compare " + pair() + " " + options).code, 64) << options;
  EXPECT_EQ(run("compare " + pair() + " --limit sigmas:1:2").code, 3);
  save("grey.exr", plane(1.0f, {550.0}));
  EXPECT_EQ(run("compare " + file("grey.exr") + " " + file("grey.exr") + " --limit angle:1:2").code,
            3);
}

TEST_F(Compare, StatisticalModeTellsNoiseFromError) {
  save("u.exr", plane(0.1f));
  save("test.exr", image(0.1f, 1));
  const std::string options = " --uncertainty " + file("u.exr") + " --samples 64 --statistical";
  const Outcome noise = run("compare " + pair() + options);
  EXPECT_EQ(noise.code, 0) << noise.text;
  EXPECT_THAT(noise.text, HasSubstr("agree within k = 2"));
  Image shifted = image(0.1f, 1);
  for (auto& channel : shifted.channels)
    for (float& v : channel.samples) v += 0.1f;
  save("test.exr", shifted);
  EXPECT_EQ(run("compare " + pair() + options).code, 2);
  // A variance of 64 samples says the same as the standard error it makes.
  save("variance.exr", plane(0.64f));
  EXPECT_EQ(run("compare " + pair() + " --variance " + file("variance.exr") +
                " --samples 64 --statistical")
                .code,
            2);
}

TEST_F(Compare, NoNumberNeverPasses) {
  Image test = image(0.0f, 0);
  test.channels[2].samples[7] = std::numeric_limits<float>::quiet_NaN();
  save("test.exr", test);
  const Outcome bad = run("compare " + pair() + " --fail 1e9 --outliers 1");
  EXPECT_EQ(bad.code, 2);
  EXPECT_THAT(bad.text, HasSubstr("1 of 768 pixels hold NaN or Inf"));
  save("mask.exr", [] {
    Image mask(32, 24);
    mask.add_channel("Y", 1.0f).samples[7] = 0.0f;
    return mask;
  }());
  EXPECT_EQ(run("compare " + pair() + " --mask " + file("mask.exr")).code, 0);
}

TEST_F(Compare, LeavesEveryFormatAndFollowsTheSchema) {
  Image test = image(0.0f, 0);
  test.channels[0].samples[3] = 90.0f;  // clipped on a display
  save("test.exr", test);
  save("u.exr", plane(0.1f));
  Image ids(32, 24);
  ids.add_channel("Y", 1.0f).samples[3] = 2.0f;
  save("ids.exr", ids);
  std::ofstream(folder_ / "names.csv") << "id,name\n1,floor\n2,lamp\n";
  const std::string options = " --uncertainty " + file("u.exr") + " --calibration 0.01 --regions " +
                              file("ids.exr") + " --region-names " + file("names.csv") +
                              " --observer 1964 --relative --fail 0.05 --annotations -o ";
  const Outcome first = run("compare " + pair() + options + file("first"));
  EXPECT_EQ(first.code, 2) << first.text;
  EXPECT_THAT(first.text, HasSubstr("::error title="));
  for (const char* name : {"report.html", "report.json", "junit.xml", "summary.md", "badge.json",
                           "metrics.txt", "difference.exr"})
    EXPECT_TRUE(fs::exists(folder_ / "first" / name)) << name;
  const Outcome second = run("compare " + pair() + options + file("second") + " --baseline " +
                             file("first/report.json"));
  EXPECT_EQ(second.code, 2);
  const std::string json = text_of(folder_ / "second" / "report.json");
  const auto report = nlohmann::json::parse(json);
  EXPECT_EQ(report["checks"][1]["earlier"].size(), 1u);
  const std::string html = text_of(folder_ / "second" / "report.html");
  for (const char* part : {"CIE 1964 10 deg", "white D65", "Surface by surface", "lamp",
                           "CIEDE2000", "dE ITP", "HDR-FLIP", "SSIM", "Spectral angle", "E_n",
                           "chi^2", "Since the baseline", "what is not shown as it is"})
    EXPECT_THAT(html, HasSubstr(part)) << part;
  EXPECT_EQ(run("report " + file("second/report.json") + " -o " + file("again.html")).code, 0);
  EXPECT_EQ(text_of(folder_ / "again.html"), html);
  EXPECT_EQ(run("compare " + pair() + " --baseline " + file("names.csv")).code, 4);
  if (!has_schema_validator()) GTEST_SKIP() << "python3-jsonschema is not installed";
  EXPECT_EQ(schema_objection("report.schema.json", json), std::nullopt);
}

TEST_F(Compare, AcceptReplacesTheReferenceAndKeepsWhy) {
  save("test.exr", image(0.2f, 9));
  EXPECT_EQ(run("compare " + pair()).code, 2);
  EXPECT_EQ(run("accept " + pair()).code, 64);  // no reason
  EXPECT_EQ(run("accept " + pair() + " --reason ' '").code, 64);
  EXPECT_EQ(run("accept " + pair() + " --reason 'new lamp, \"measured\"'").code, 0);
  EXPECT_EQ(text_of(file("reference.exr")), text_of(file("test.exr")));
  const Outcome now = run("compare " + pair() + " -o " + file("out"));
  EXPECT_EQ(now.code, 0);
  EXPECT_THAT(text_of(folder_ / "out" / "report.json"), HasSubstr("new lamp, \\\"measured\\\""));
  save("test.exr", image(0.0f, 0));
  EXPECT_EQ(run("accept " + pair() + " --reason back").code, 0);
  const std::string text = text_of(file("reference.exr.provenance.json"));
  const auto provenance = nlohmann::json::parse(text);
  ASSERT_EQ(provenance["accepted"].size(), 2u);
  EXPECT_EQ(provenance["accepted"][0]["reason"], "new lamp, \"measured\"");
  // Someone changes the file behind the program's back: the report says so.
  save("reference.exr", image(0.1f, 2));
  EXPECT_EQ(run("compare " + pair() + " -o " + file("out")).code, 2);
  EXPECT_THAT(text_of(folder_ / "out" / "report.json"), HasSubstr("has changed since"));
  std::ofstream(file("broken.exr")) << "no image";
  EXPECT_EQ(run("accept " + file("broken.exr") + " " + file("reference.exr") + " --reason x").code,
            4);
  if (!has_schema_validator()) GTEST_SKIP() << "python3-jsonschema is not installed";
  EXPECT_EQ(schema_objection("acceptance.schema.json", text), std::nullopt);
}

class Suite : public Compare {
 protected:
  std::string suite(const std::string& text) const {
    std::ofstream(folder_ / "suite.toml") << text;
    return file("suite.toml");
  }
};

TEST_F(Suite, RunsAllThoughOneIsBrokenAndExitsWithTheWorst) {
  save("same.exr", image(0.0f, 0));
  Image off = image(0.0f, 0);
  for (float& v : off.channels[0].samples) v *= 1.03f;
  save("off.exr", off);
  save("small.exr", Image(plane(1.0f)));
  const std::string path = suite(R"(title = "Three <boxes>"
[defaults]
reference = "reference.exr"
relative = true
warn = 0.02
fail = 0.05
[[compare]]
name = "same"
tags = ["a"]
test = "same.exr"
[[compare]]
name = "off"
tags = ["a", "b"]
test = "off.exr"
limit = ["rmse:1:2", "flip-mean:0.5:1"]
[[compare]]
name = "missing"
test = "none.exr"
[[compare]]
name = "bands"
test = "same.exr"
band = 550
)");
  const Outcome all = run("suite " + path + " -o " + file("out"));
  EXPECT_EQ(all.code, 4) << all.text;  // the missing file
  for (const char* name : {"same", "off", "bands"})
    EXPECT_TRUE(fs::exists(folder_ / "out" / name / "report.html")) << name;
  EXPECT_FALSE(fs::exists(folder_ / "out" / "missing"));
  const std::string index = text_of(folder_ / "out" / "index.html");
  for (const char* part : {"Three &lt;boxes&gt;", "none.exr", "same/report.html", "data:image/png",
                           "data-tags=\"a\nb\""})
    EXPECT_THAT(index, HasSubstr(part)) << part;
  const auto report = nlohmann::json::parse(text_of(folder_ / "out" / "report.json"));
  ASSERT_EQ(report["checks"].size(), 4u);
  EXPECT_EQ(report["checks"][0]["outcome"], "agrees");
  EXPECT_EQ(report["checks"][1]["outcome"], "warning");
  EXPECT_EQ(report["checks"][2]["outcome"], "not run");
  const Outcome again =
      run("suite " + path + " --threads 1 -o " + file("again") + " --baseline " + file("out"));
  EXPECT_EQ(again.code, 4);
  EXPECT_THAT(text_of(folder_ / "again" / "off" / "report.html"), HasSubstr("Since the baseline"));
  if (!has_schema_validator()) GTEST_SKIP() << "python3-jsonschema is not installed";
  EXPECT_EQ(schema_objection("report.schema.json", report.dump()), std::nullopt);
}

TEST_F(Suite, MistakesNameTheirLine) {
  const std::string good = "[[compare]]\nname = \"a\"\ntest = \"x.exr\"\nreference = \"y.exr\"\n";
  for (const auto& [text, expected] :
       {std::pair<std::string, std::string>{"[[compare]\n", "suite.toml:1"},
        {"title = \"none\"\n", "at least one [[compare]]"},
        {"colour = 1\n" + good, "suite.toml:1: expected title"},
        {good + "speed = 3\n", "suite.toml:1: expected options of truebox compare for a"},
        {good + "warn = -1\n", "suite.toml:1"},
        {good + "fail = { a = 1 }\n", "suite.toml:5"},
        {good + good, "a name that no other comparison has"},
        {"[[compare]]\nname = \"../a\"\ntest = \"x\"\nreference = \"y\"\n", "suite.toml:2"},
        {"[[compare]]\nname = \"a/b\"\ntest = \"x\"\nreference = \"y\"\n", "suite.toml:2"},
        {"[[compare]]\ntest = \"x\"\n", "suite.toml:1: expected a name"},
        {"[[compare]]\nname = \"a\"\ntest = \"x\"\n", "reference"}}) {
    const Outcome broken = run("suite " + suite(text) + " -o " + file("out"));
    EXPECT_EQ(broken.code, 4) << text;
    EXPECT_THAT(broken.text, HasSubstr(expected)) << text;
    EXPECT_FALSE(fs::exists(folder_ / "out")) << text;
  }
}

}  // namespace
}  // namespace truebox

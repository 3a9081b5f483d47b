// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>

#include "image/image_file.h"
#include "support/run_command.h"
#include "support/scratch.h"

namespace truebox {
namespace {

using testing::HasSubstr;

CommandOutcome truebox(const std::string& arguments) {
  return run_command("'" TRUEBOX_PROGRAM "' " + arguments);
}

/// The shipped picture by another program, two of its bands, few elements; `more` is TOML.
std::string measurement(const std::string& more) {
  const std::string reference = TRUEBOX_REFERENCE_DIR;
  const auto relative = [&](const std::string& file) {
    return std::filesystem::relative(reference + "/" + file,
                                     std::filesystem::path(scratch_path("x")).parent_path())
        .string();
  };
  const std::string path = scratch_path("fit_program.toml");
  write_file_atomically(path,
                        "title = \"box\"\nsource = \"test\"\nsimulated = \"yes\"\nscene = \"" +
                            relative("cornell_box/cornell_box.toml") +
                            "\"\n[model]\nbands_nm = [552, 652]\nelements = 400\nrobust_sigma = 3\n"
                            "[[photographs]]\nfile = \"" +
                            relative("independent_renders/cornell_box_front_256_7bands.exr") +
                            "\"\ncamera = \"front\"\nabsolute_u = 0.001\nblock_relative_u = 0.003\n"
                            "[reflectances.white]\nfit = \"free\"\nstart = 0.5\n" +
                            more);
  return path;
}

TEST(FitSceneProgram, WritesEstimatesReportAndResidualMaps) {
  const std::string directory = scratch_path("fit_report"), json = scratch_path("fit.json");
  const CommandOutcome result =
      truebox("fit " + measurement("") + " -o " + json + " --report " + directory);
  EXPECT_EQ(result.code, 0) << result.text;
  EXPECT_THAT(result.text, HasSubstr("simulated photographs"));
  EXPECT_THAT(result.text, HasSubstr("reflectance white, 552 nm"));
  std::ifstream file(json);
  const auto found = nlohmann::json::parse(file);
  EXPECT_EQ(found["outcome"], "converged");
  EXPECT_EQ(found["parameters"].size(), 4u);
  // 400 elements do not resolve the blocks' feet: a few per cent is what they can do.
  EXPECT_NEAR(found["parameters"][0]["value"].get<double>(), 0.728, 0.03);
  EXPECT_GT(found["parameters"][0]["u"].get<double>(), 0.0);
  EXPECT_EQ(found["correlation"].size(), 4u);
  EXPECT_TRUE(std::filesystem::exists(directory + "/report.html"));
  EXPECT_TRUE(std::filesystem::exists(directory + "/residuals_2.png"));
  const Image map = read_image(directory + "/residuals.exr");
  EXPECT_EQ(map.width, 256);
  EXPECT_NE(map.find("552 nm.z"), nullptr);
}

TEST(FitSceneProgram, ExitsWithFiveAndNamesTheNullDirection) {
  const CommandOutcome result =
      truebox("fit " + measurement("[emissions.light]\nfit = \"free\"\n"));
  EXPECT_EQ(result.code, 5) << result.text;
  EXPECT_THAT(result.text, HasSubstr("rank deficient"));
  EXPECT_THAT(result.text, HasSubstr("emission scale"));
  EXPECT_THAT(result.text, HasSubstr("all gains"));
  EXPECT_THAT(result.text, HasSubstr("no u"));
}

TEST(FitSceneProgram, EndsCleanlyAtCtrlCDuringFormFactors) {
  // So many elements that form factors take far longer than the four seconds until SIGINT. In the
  // background timeout sends it to its group as well, and the second one ends the program.
  std::string path = measurement("");
  std::ifstream file(path);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  text.replace(text.find("elements = 400"), 14, "elements = 12000");
  write_file_atomically(path, text);
  const std::string json = scratch_path("stopped.json"), directory = scratch_path("stopped");
  const CommandOutcome result =
      run_command("timeout --foreground --preserve-status -s INT 4 '" TRUEBOX_PROGRAM "' fit " +
                  path + " -o " + json + " --report " + directory);
  EXPECT_EQ(result.code, 5) << result.text;
  EXPECT_THAT(result.text, HasSubstr("stopped by the user before there was a fit"));
  EXPECT_FALSE(std::filesystem::exists(json));
  EXPECT_FALSE(std::filesystem::exists(directory));
}

TEST(FitSceneProgram, ReportsTheCameraWithItsUnits) {
  const std::string json = scratch_path("camera.json");
  const CommandOutcome result =
      truebox("fit " + measurement("[cameras.front]\npose = { fit = \"free\" }\n") + " -o " + json);
  EXPECT_EQ(result.code, 0) << result.text;
  std::ifstream file(json);
  const auto found = nlohmann::json::parse(file);
  std::map<std::string, std::string> units;
  for (const auto& p : found["parameters"]) units[p["name"]] = p["unit"];
  EXPECT_EQ(units["camera front, tilt"], "rad");
  EXPECT_EQ(units["camera front, forward"], "mm");
  EXPECT_EQ(units["reflectance white, 552 nm"], "1");
}

TEST(FitSceneProgram, ExitsWithFourAtAMistake) {
  const CommandOutcome result = truebox("fit " + measurement("[emissions.lamp]\nfit = \"free\"\n"));
  EXPECT_EQ(result.code, 4);
  EXPECT_THAT(result.text, HasSubstr("fit_program.toml:17"));
  EXPECT_THAT(result.text, HasSubstr("a material of the scene"));
}

}  // namespace
}  // namespace truebox

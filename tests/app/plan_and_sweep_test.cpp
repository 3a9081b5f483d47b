// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "support/run_command.h"
#include "support/scratch.h"

namespace truebox {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

CommandOutcome run(const std::string& arguments, const std::string& environment = "") {
  return run_command(environment +
                     " TRUEBOX_REFERENCE='" TRUEBOX_REFERENCE_DIR "' '" TRUEBOX_PROGRAM "' " +
                     arguments);
}

std::string text_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string write(const std::string& name, const std::string& text) {
  const std::string path = scratch_path(name);
  std::ofstream(path, std::ios::binary) << text;
  return path;
}

// A closed cube, the ceiling shines; convex and, but for the floor, grey.
std::string room(const std::string& name, double floor = 0.5, bool mirror = false) {
  std::ostringstream text;
  text << "length_unit = \"m\"\n[bands]\ncentres_nm = [450, 550, 650]\n[materials.grey]\n"
          "reflectance = 0.5\n[materials.floor]\n";
  if (mirror)
    text << "scattering = \"mirror\"\nreflectance = 0.8\n";
  else
    text << "reflectance = " << floor << "\n";
  text << "[materials.lamp]\nreflectance = 0.5\nexitance = { nm = [400, 700], value = [1, 2] }\n";
  const char* const faces[] = {
      "[[0,0,0],[1,0,0],[1,1,0],[0,1,0]]", "[[0,0,1],[0,1,1],[1,1,1],[1,0,1]]",
      "[[0,0,0],[0,0,1],[1,0,1],[1,0,0]]", "[[0,1,0],[1,1,0],[1,1,1],[0,1,1]]",
      "[[0,0,0],[0,1,0],[0,1,1],[0,0,1]]", "[[1,0,0],[1,0,1],[1,1,1],[1,1,0]]"};
  for (int k = 0; k < 6; ++k)
    text << "[[surfaces]]\nname = \"face " << k << "\"\nmaterial = \""
         << (k == 0   ? "floor"
             : k == 1 ? "lamp"
                      : "grey")
         << "\"\nvertices = " << faces[k] << "\n";
  text << "[cameras.eye]\nposition = [0.5, 0.1, 0.5]\ndirection = [0, 1, 0]\nup = [0, 0, 1]\n"
          "focal_length_mm = 20\nfilm_mm = [24, 24]\npixels = [12, 12]\n";
  return write(name, text.str());
}

std::string small_sweep(const std::string& scene, const std::string& folder) {
  return "sweep " + scene +
         " --places 4 --largest-elements 300 --largest-paths 64 --reference-error 5% --quiet -o " +
         folder;
}

json points_without_time(const fs::path& file) {
  json points = json::parse(text_of(file)).at("points");
  for (json& point : points) {
    point.erase("cpu_s");
    point.erase("on_front");
  }
  return points;
}

TEST(PlanProgram, WritesThePlanAndProvesIt) {
  const std::string scene = room("planned.toml"), file = scratch_path("plan.json");
  const CommandOutcome plan =
      run("plan " + scene + " --target-error 5% --verify --verify-elements 200 --json " + file);
  EXPECT_EQ(plan.code, 0) << plan.text;
  EXPECT_THAT(plan.text, HasSubstr("which surfaces see which"));
  EXPECT_THAT(plan.text, HasSubstr("face 0                  .#####"));
  const json j = json::parse(text_of(file));
  EXPECT_EQ(j.at("bands_distinct"), 1) << "grey walls: the bands are multiples";
  EXPECT_FALSE(j.at("occlusion").get<bool>());
  EXPECT_EQ(j.at("visibility")[0].at("sees").size(), 5u);
  ASSERT_GE(j.at("claims").size(), 3u);
  for (const json& claim : j.at("claims")) EXPECT_TRUE(claim.at("holds").get<bool>()) << claim;
}

TEST(PlanProgram, SolvesAsPlannedByOneWordAndByThePrintedLine) {
  const std::string scene = room("automatic.toml"), a = scratch_path("auto.json"),
                    b = scratch_path("typed.json"), plan = scratch_path("plan_line.json");
  ASSERT_EQ(run("plan " + scene + " --target-error 3% --quiet --json " + plan).code, 0);
  const std::string line = json::parse(text_of(plan)).at("command");
  const CommandOutcome automatic = run("solve " + scene + " --auto --target-error 3% -o " + a);
  EXPECT_EQ(automatic.code, 0) << automatic.text;
  EXPECT_THAT(automatic.text, HasSubstr("as planned: " + line));
  ASSERT_EQ(run(line.substr(line.find(' ')) + " -o " + b).code, 0) << line;
  const json first = json::parse(text_of(a)), second = json::parse(text_of(b));
  EXPECT_EQ(first.at("surfaces"), second.at("surfaces"));
  EXPECT_LE(first.at("largest_relative_bound_of_a_surface").get<double>(), 0.03);
  EXPECT_EQ(run("solve " + scene + " --auto --elements 100").code, 64);
}

// Constants would take more elements than fit.
TEST(PlanProgram, TakesPolynomialsForMeansAndConstantsForFilesOfAllElements) {
  const std::string scene = room("polynomial.toml"), a = scratch_path("polynomial.json"),
                    b = scratch_path("polynomial_typed.json");
  const std::string wished = "solve " + scene + " --auto --target-error 0.02% -o " + a;
  const CommandOutcome automatic = run(wished);
  EXPECT_EQ(automatic.code, 0) << automatic.text;
  EXPECT_THAT(automatic.text, HasSubstr("as planned: truebox solve"));
  EXPECT_THAT(automatic.text, HasSubstr("--basis "));
  const std::size_t at = automatic.text.find("truebox solve") + 8;
  const std::string line = automatic.text.substr(at, automatic.text.find('\n', at) - at);
  ASSERT_EQ(run(line + " -o " + b).code, 0) << line;
  const json first = json::parse(text_of(a)), second = json::parse(text_of(b));
  EXPECT_EQ(first.at("surfaces"), second.at("surfaces"));
  EXPECT_LE(first.at("largest_relative_bound_of_a_surface").get<double>(), 2e-4);
  EXPECT_EQ(first.at("surfaces")[0].at("irradiance").size(), 3u);
  const CommandOutcome elements =
      run("solve " + scene + " --auto --target-error 5% -o " + scratch_path("polynomial.vtu"));
  EXPECT_EQ(elements.code, 0) << elements.text;
  EXPECT_THAT(elements.text, Not(HasSubstr("--basis")));
  EXPECT_EQ(run("solve " + scene + " --auto --basis linear").code, 64);
}

// The cube with two walls of chart colours under daylight, in 31 bands.
std::string colourful_room() {
  std::string text = text_of(room("grey.toml"));
  const std::string colour = std::string(TRUEBOX_REFERENCE_DIR) + "/colour/";
  const auto replace = [&](const std::string& old, const std::string& with) {
    text.replace(text.find(old), old.size(), with);
  };
  replace("centres_nm = [450, 550, 650]", "from_nm = 400\nto_nm = 700\nstep_nm = 10");
  replace("reflectance = 0.5", "reflectance = { file = \"" + colour +
                                   "colorchecker24_ohta.csv\", column = \"orange\" }");
  replace("[materials.floor]\nreflectance = 0.5",
          "[materials.floor]\nreflectance = { file = \"" + colour +
              "colorchecker24_ohta.csv\", column = \"cyan\" }");
  replace("{ nm = [400, 700], value = [1, 2] }",
          "{ file = \"" + colour + "cie_illuminants.csv\", column = \"D65\" }");
  return write("colourful.toml", text);
}

TEST(PlanProgram, SaysHowManyBandsAColourTakesAndSolvesInThem) {
  const std::string scene = colourful_room(), file = scratch_path("colour.json"),
                    solved = scratch_path("colour_solved.json");
  const CommandOutcome plan =
      run("plan " + scene + " --target-error 20% --target-colour 1 --quiet --json " + file);
  ASSERT_EQ(plan.code, 0) << plan.text;
  const json j = json::parse(text_of(file));
  ASSERT_GE(j.at("colour").size(), 4u);
  int chosen = 0;
  for (const json& choice : j.at("colour"))
    if (choice.at("largest_dE00").get<double>() <= 1.0 && chosen == 0)
      chosen = choice.at("bands").get<int>();
  EXPECT_GT(chosen, 4);
  EXPECT_LE(chosen, 24);
  const std::string line = j.at("command");
  EXPECT_THAT(line, HasSubstr("--bands " + std::to_string(chosen)));
  ASSERT_EQ(run(line.substr(line.find(' ')) + " --quiet -o " + solved).code, 0);
  EXPECT_EQ(json::parse(text_of(solved)).at("bands"), chosen);
}

TEST(PlanProgram, RefusesWhatItCannotPlan) {
  const std::string scene = room("refused.toml");
  EXPECT_EQ(run("plan " + scene + " --target-error 0").code, 64);
  EXPECT_EQ(run("plan " + scene + " --camera ear").code, 4);
  EXPECT_THAT(run("plan " + scene + " --surface roof").text, HasSubstr("face 0"));
  EXPECT_EQ(run("plan " + scene + " --surface 'face 0' --camera eye").code, 64);
  const std::string mirror = room("mirror.toml", 0.5, true);
  EXPECT_THAT(run("plan " + mirror + " --quiet").text, HasSubstr("render"));
  EXPECT_EQ(run("solve " + mirror + " --auto").code, 4);
}

TEST(SweepProgram, SweepsEveryMethodAgainstTracedPathsAndReports) {
  const std::string scene = room("swept.toml", 0.7), folder = scratch_path("swept");
  const CommandOutcome swept = run(small_sweep(scene, folder));
  ASSERT_EQ(swept.code, 0) << swept.text;
  const json sweep = json::parse(text_of(folder + "/sweep.json"));
  std::set<std::string> methods;
  bool front = false;
  for (const json& point : sweep.at("points")) {
    methods.insert(point.at("method").get<std::string>());
    front |= point.at("on_front").get<bool>();
  }
  EXPECT_EQ(methods.size(), 5u);
  EXPECT_TRUE(front);
  EXPECT_THAT(sweep.at("left_out").dump(), HasSubstr("by rays: nothing can stand between"));
  EXPECT_THAT(swept.text, HasSubstr("left out: a matrix by rays"));
  EXPECT_THAT(sweep.at("reference").get<std::string>(), HasSubstr("path tracing"));
  EXPECT_GT(sweep.at("reference_error").get<double>(), 0.0);
  EXPECT_THAT(text_of(folder + "/report.html"), HasSubstr("Pareto front"));
}

// Who takes longer must gain one percent that the reference can tell.
TEST(SweepProgram, PutsNobodyOnTheFrontForAGainThatIsNone) {
  const std::string scene = room("front.toml", 0.7), folder = scratch_path("front");
  ASSERT_EQ(run(small_sweep(scene, folder)).code, 0);
  const json sweep = json::parse(text_of(folder + "/sweep.json"));
  const double resolved = sweep.at("errors_told_apart_above");
  EXPECT_GT(resolved, sweep.at("reference_error").get<double>());
  const auto& points = sweep.at("points");
  for (const json& p : points)
    for (const json& q : points)
      if (p.at("on_front") && q.at("on_front") && p.at("cpu_s") < q.at("cpu_s")) {
        EXPECT_GT(0.99 * p.at("error").get<double>(),
                  std::max(resolved, q.at("error").get<double>()) * (1.0 - 1e-12))
            << q;
      }
}

TEST(SweepProgram, GoesOnWhereItWasStopped) {
  const std::string scene = room("stopped.toml", 0.7), folder = scratch_path("stopped");
  ASSERT_EQ(run(small_sweep(scene, folder)).code, 0);
  const json whole = json::parse(text_of(folder + "/sweep.json"));
  json state = json::parse(text_of(folder + "/run.json"));
  state["results"].erase("0");  // as if it had ended before
  std::ofstream(folder + "/run.json") << state;
  const std::string again =
      small_sweep(scene, folder).replace(small_sweep(scene, folder).find(" --quiet"), 8, "");
  const CommandOutcome resumed = run(again);
  ASSERT_EQ(resumed.code, 0) << resumed.text;
  EXPECT_THAT(resumed.text, HasSubstr("continuing"));
  const json after = json::parse(text_of(folder + "/sweep.json"));
  ASSERT_EQ(after.at("points").size(), whole.at("points").size());
  for (std::size_t k = 0; k < after.at("points").size(); ++k) {
    EXPECT_EQ(after["points"][k]["error"], whole["points"][k]["error"]);
    if (k > 0) {
      EXPECT_EQ(after["points"][k]["cpu_s"], whole["points"][k]["cpu_s"])
          << "was done before: not done again";
    }
  }
}

TEST(SweepProgram, NoticesThatTheSceneOrASettingHasChanged) {
  const std::string folder = scratch_path("changed");
  ASSERT_EQ(run(small_sweep(room("changed.toml", 0.7), folder)).code, 0);
  const CommandOutcome setting =
      run(small_sweep(scratch_path("changed.toml"), folder) + " --camera eye");
  EXPECT_EQ(setting.code, 4) << setting.text;
  EXPECT_THAT(setting.text, HasSubstr("it has changed since"));
  const CommandOutcome scene = run(small_sweep(room("changed.toml", 0.71), folder));
  EXPECT_EQ(scene.code, 4);
  EXPECT_THAT(scene.text, HasSubstr("run.json: expected scene "));
  EXPECT_EQ(run(small_sweep(scratch_path("changed.toml"), folder) + " --restart").code, 0);
  std::ofstream(folder + "/run.json") << "{}";
  EXPECT_EQ(run(small_sweep(scratch_path("changed.toml"), folder)).code, 4);
}

TEST(SweepProgram, OfAMirrorTracesPathsAgainstManyMore) {
  const std::string folder = scratch_path("mirrored");
  const CommandOutcome swept = run(small_sweep(room("mirrored.toml", 0.5, true), folder));
  ASSERT_EQ(swept.code, 0) << swept.text;
  const json sweep = json::parse(text_of(folder + "/sweep.json"));
  for (const json& point : sweep.at("points")) EXPECT_EQ(point.at("method"), "paths");
  EXPECT_THAT(sweep.at("left_out").dump(), HasSubstr("not Lambertian"));
  EXPECT_THAT(sweep.at("reference").get<std::string>(), HasSubstr("1024 paths"));
}

TEST(SweepProgram, RefusesAReferenceThatLacksAPlace) {
  const std::string scene = room("referred.toml");
  const std::string points = write(
      "places.csv", "name,x,y,z,nx,ny,nz\nmiddle,0.5,0.5,0,0,0,1\nelsewhere,0.2,0.5,0,0,0,1\n");
  const std::string values =
      write("values.csv", "name,band_nm,irradiance,standard_error\nmiddle,550,1.5,0.01\n");
  const CommandOutcome lacking =
      run("sweep " + scene + " --points " + points + " --reference " + values);
  EXPECT_EQ(lacking.code, 4);
  EXPECT_THAT(lacking.text, HasSubstr("\"elsewhere\" in the band at 550 nm"));
  EXPECT_EQ(run("sweep " + scene + " --reference " + values).code, 4) << "of which places?";
  const std::string other =
      write("bands.csv", "name,band_nm,irradiance,standard_error\nmiddle,500,1.5,0.01\n");
  EXPECT_EQ(run("sweep " + scene + " --points " + points + " --reference " + other).code, 4);
  const std::string air = write("air.csv", "name,x,y,z,nx,ny,nz\nair,0.5,0.5,0.5,0,0,1\n");
  EXPECT_THAT(run("sweep " + scene + " --points " + air).text, HasSubstr("\"air\" is on none"));
}

TEST(Merge, OfThePartsOfASweepIsTheSweep) {
  const std::string scene = room("parts.toml", 0.7), folder = scratch_path("parts"),
                    whole = scratch_path("whole");
  ASSERT_EQ(run(small_sweep(scene, whole)).code, 0);
  std::string files;
  for (int k = 0; k < 3; ++k) {
    const CommandOutcome part =
        run(small_sweep(scene, folder) + " --parts 3 --index auto",
            "SLURM_ARRAY_TASK_MIN=1 SLURM_ARRAY_TASK_ID=" + std::to_string(k + 1));
    ASSERT_EQ(part.code, 0) << part.text;
    files += " " + folder + "/part-" + std::to_string(k) + "-of-3.json";
  }
  const CommandOutcome merged = run("merge" + files + " -o " + folder);
  ASSERT_EQ(merged.code, 0) << merged.text;
  EXPECT_EQ(points_without_time(folder + "/sweep.json"),
            points_without_time(whole + "/sweep.json"));
  EXPECT_TRUE(fs::exists(folder + "/report.html"));
}

class SolveArray : public testing::Test {
 protected:
  void SetUp() override {
    name_ = testing::UnitTest::GetInstance()->current_test_info()->name();
    folder_ = scratch_path(name_);
    line_ = "solve " + room(name_ + "_a.toml", 0.2) + " " + room(name_ + "_b.toml", 0.7) +
            " --vary elements=100,200 --quiet -o " + folder_;
  }
  std::string part(int k, int of = 2) const {
    return folder_ + "/part-" + std::to_string(k) + "-of-" + std::to_string(of) + ".json";
  }
  CommandOutcome run_part(int k) const {
    return run(line_ + " --parts 2 --index " + std::to_string(k));
  }
  // The table without the column of times.
  static std::string untimed(const std::string& csv) {
    std::istringstream lines(csv);
    std::string all, line;
    while (std::getline(lines, line)) {
      std::size_t from = 0;
      for (int comma = 0; comma < 2; ++comma) from = line.find(',', from) + 1;
      all += line.erase(from, line.find(',', from) - from) + "\n";
    }
    return all;
  }
  std::string name_, folder_, line_;
};

TEST_F(SolveArray, OfTwoPartsMergesIntoTheTableOfOneRun) {
  const CommandOutcome whole = run(line_);
  ASSERT_EQ(whole.code, 0) << whole.text;
  const std::string table = whole.text.substr(whole.text.find("job,exit_code"));
  ASSERT_EQ(run_part(0).code, 0);
  const CommandOutcome early = run("merge " + part(0));
  EXPECT_EQ(early.code, 4);
  EXPECT_THAT(early.text, HasSubstr("no part 1"));
  ASSERT_EQ(run_part(1).code, 0);
  const std::string csv = folder_ + "/table.csv";
  const CommandOutcome merged = run("merge " + part(1) + " " + part(0) + " --csv " + csv);
  ASSERT_EQ(merged.code, 0) << merged.text;
  EXPECT_EQ(untimed(text_of(csv)), untimed(table));
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 5);
  EXPECT_THAT(table, HasSubstr("_a_elements-100"));
  EXPECT_THAT(table, HasSubstr("mean_irradiance"));
}

TEST_F(SolveArray, MergesOnlyPartsOfOneRun) {
  ASSERT_EQ(run_part(0).code, 0);
  ASSERT_EQ(run_part(1).code, 0);
  EXPECT_THAT(run("merge " + part(0) + " " + part(0)).text, HasSubstr("each part once"));
  const std::string good = text_of(part(1));
  const auto altered = [&](const std::string& pointer, const json& value) {
    json j = json::parse(good);
    j[json::json_pointer(pointer)] = value;
    std::ofstream(part(1)) << j;
    const CommandOutcome outcome = run("merge " + part(0) + " " + part(1));
    EXPECT_EQ(outcome.code, 4) << pointer;
    return outcome.text;
  };
  EXPECT_THAT(altered("/run/version", "0.0.9"), HasSubstr("0.0.9"));
  EXPECT_THAT(altered("/run/inputs/settings", "--rays 8"), HasSubstr("it has changed since"));
  EXPECT_THAT(altered("/run/command", "render"), HasSubstr("results of the command"));
  EXPECT_THAT(altered("/results", json::object()), HasSubstr("run this part again"));
  EXPECT_THAT(altered("/run/index", 5), HasSubstr("a part that there is not"));
  std::ofstream(part(1)) << good.substr(0, good.size() / 2);
  EXPECT_EQ(run("merge " + part(0) + " " + part(1)).code, 4);
  std::ofstream(part(1)) << good;
  std::ofstream(folder_ + "/" + name_ + "_b_elements-200.json") << "{}";
  EXPECT_THAT(run("merge " + part(0) + " " + part(1)).text, HasSubstr("another one"));
}

TEST_F(SolveArray, RefusesPartsAndSettingsThatThereAreNot) {
  EXPECT_EQ(run(line_ + " --parts 2 --index 2").code, 4);
  EXPECT_EQ(run(line_ + " --parts 2").code, 4);
  EXPECT_EQ(run(line_ + " --index 0").code, 4);
  EXPECT_EQ(run(line_ + " --parts 2 --index one").code, 4);
  EXPECT_THAT(run(line_ + " --index auto", "env -u SLURM_ARRAY_TASK_ID").text,
              HasSubstr("SLURM_ARRAY_TASK_ID"));
  EXPECT_EQ(run(line_ + " --vary colour=red").code, 4);
  EXPECT_EQ(run(line_ + " --vary rays").code, 4);
  EXPECT_EQ(run(line_ + " --rays 8 --vary rays=8,16").code, 4);
  EXPECT_THAT(run(line_ + ".json").text, HasSubstr("a folder for the results of all jobs"));
  EXPECT_FALSE(fs::exists(folder_));
}

TEST_F(SolveArray, KeepsWhatIsDoneWhenAJobFails) {
  const CommandOutcome outcome =
      run("solve " + room(name_ + "_a.toml") + " " + room(name_ + "_m.toml", 0.5, true) +
          " --elements 100 --quiet -o " + folder_);
  EXPECT_EQ(outcome.code, 4) << "the mirror's";
  EXPECT_THAT(outcome.text, HasSubstr(name_ + "_a,0,"));
  EXPECT_THAT(outcome.text, HasSubstr(name_ + "_m,4,"));
}

TEST(RenderArray, LeavesAPictureEachJob) {
  const std::string folder = scratch_path("pictures");
  const CommandOutcome outcome = run("render " + room("pictured.toml") +
                                     " --method path --vary samples=16,32 --quiet -o " + folder);
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  EXPECT_TRUE(fs::exists(folder + "/pictured_samples-16.exr"));
  EXPECT_TRUE(fs::exists(folder + "/pictured_samples-32.exr"));
}

}  // namespace
}  // namespace truebox

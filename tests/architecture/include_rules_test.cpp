// SPDX-License-Identifier: BSD-3-Clause
#include "architecture/include_rules.h"

#include <gmock/gmock.h>

#include <fstream>
#include <iterator>

namespace truebox {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
namespace fs = std::filesystem;

const fs::path kCheckout = TRUEBOX_SOURCE_DIR;

struct Planted {
  std::string name, path, include, why;
};

class PlantedInclude : public testing::TestWithParam<Planted> {};

TEST_P(PlantedInclude, IsFound) {
  const Planted& p = GetParam();
  EXPECT_THAT(include_violations(p.path, "// x\n#include " + p.include + "\n"),
              ElementsAre(HasSubstr(p.why)));
}

INSTANTIATE_TEST_SUITE_P(
    Each, PlantedInclude,
    testing::Values(
        Planted{"right_to_left", "solver/scene/a.cpp", "\"mesh/patch_mesh.h\"", "order"},
        Planted{"radiometry_to_image", "solver/radiometry/a.h", "\"image/image.h\"", "order"},
        Planted{"solver_to_reference", "solver/sensor/a.cpp", "\"readings/chart.h\"", "order"},
        Planted{"reference_to_solver", "reference/readings/a.cpp", "\"scene/scene.h\"", "order"},
        Planted{"calibration_to_reports", "calibration/fit/a.cpp", "\"document/report.h\"",
                "order"},
        Planted{"solver_to_calibration", "solver/transport/a.cpp", "\"fit/chart_fit.h\"", "order"},
        Planted{"paths_to_radiosity", "solver/path_tracer/a.cpp", "\"transport/gather.h\"",
                "order"},
        Planted{"paths_to_mesh", "solver/path_tracer/a.cpp", "\"mesh/patch_mesh.h\"", "order"},
        Planted{"radiosity_to_paths", "solver/transport/a.cpp", "\"path_tracer/bsdf.h\"", "order"},
        Planted{"app", "reports/document/a.cpp", "\"app/commands.h\"", "no module"},
        Planted{"up_and_over", "solver/mesh/a.cpp", "\"../scene/scene.h\"", "write the module"},
        Planted{"bare_name", "solver/mesh/a.cpp", "\"patch_mesh.h\"", "write the module"},
        Planted{"embree", "solver/mesh/a.cpp", "<embree3/rtcore.h>", "outside"},
        Planted{"embree_beside_rays", "solver/transport/a.cpp", "<embree3/rtcore.h>", "outside"},
        Planted{"embree_in_header", "solver/rays/a.h", "<embree3/rtcore.h>", "header"},
        Planted{"openexr", "reports/document/a.cpp", "<ImfOutputFile.h>", "outside"},
        Planted{"ceres", "calibration/photometry/a.cpp", "<ceres/ceres.h>", "outside"},
        Planted{"calib3d", "reports/difference/a.cpp", "<opencv2/calib3d.hpp>", "outside"},
        Planted{"imgproc", "reports/figures/a.cpp", "<opencv2/imgproc.hpp>", "outside"},
        Planted{"jpeg", "reports/document/a.cpp", "<jpeglib.h>", "outside"},
        Planted{"tbb_in_header", "solver/transport/a.h", "<tbb/parallel_for.h>", "header"},
        Planted{"tbb_in_reports", "reports/figures/a.cpp", "<tbb/parallel_for.h>", "outside"},
        Planted{"eigen_in_reference", "reference/readings/a.cpp", "<Eigen/Core>", "outside"},
        Planted{"json", "reports/figures/a.cpp", "<nlohmann/json.hpp>", "outside"},
        Planted{"unknown", "solver/mesh/a.cpp", "<boost/format.hpp>", "no folder"},
        Planted{"indented", "solver/scene/a.cpp", "  \"transport/gather.h\"", "order"},
        Planted{"new_module", "solver/volume/a.cpp", "<vector>", "without a place"}),
    [](const auto& planted) { return planted.param.name; });

TEST(IncludeRules, AcceptWhatTheOrderAllows) {
  EXPECT_THAT(include_violations("calibration/fit/a.cpp",
                                 "#include <ceres/ceres.h>\n#include <cmath>\n"
                                 "#include \"readings/chart.h\"\n#include \"scene/scene.h\"\n"),
              IsEmpty());
  EXPECT_THAT(include_violations("solver/mesh/a.h", "#include <Eigen/Core>\n"), IsEmpty());
}

TEST(Tree, FollowsTheOrderOfTheLayers) {
  std::size_t files = 0;
  EXPECT_THAT(include_violations_of_tree(kCheckout, files), IsEmpty());
  EXPECT_GT(files, 80u) << "the checkout was not found";
}

std::string text_of(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::vector<std::string> missing_header_lines(const std::string& text) {
  std::vector<std::string> missing;
  for (const char* line : {"# source: ", "# unit: ", "# uncertainty: "})
    if (!text.starts_with(line) && text.find(std::string("\n") + line) == std::string::npos)
      missing.push_back(line);
  return missing;
}

TEST(ReferenceData, NameSourceUnitAndUncertainty) {
  EXPECT_THAT(missing_header_lines("# source: x\n# unit: 1\nnm,a\n"),
              ElementsAre("# uncertainty: "));
  std::size_t tables = 0;
  for (const auto& entry : fs::recursive_directory_iterator(kCheckout / "reference")) {
    if (entry.path().extension() != ".csv") continue;
    ++tables;
    EXPECT_THAT(missing_header_lines(text_of(entry.path())), IsEmpty()) << entry.path().filename();
  }
  EXPECT_GE(tables, 10u);
}

TEST(ReferenceData, FoldersNameTheirSources) {
  for (const auto& entry : fs::directory_iterator(kCheckout / "reference")) {
    bool has_data = false;
    for (const auto& file :
         fs::directory_iterator(entry.is_directory() ? entry.path() : kCheckout / "reference"))
      has_data |= entry.is_directory() && file.path().extension() == ".csv";
    if (!has_data) continue;
    EXPECT_TRUE(fs::exists(entry.path() / "SOURCES.md")) << entry.path().filename();
  }
}

TEST(Tree, HoldsNothingThatMayNotBePassedOn) {
  const std::string mark =
      std::string("local") + "_only";  // not written out: this file is read too
  std::size_t files = 0;
  for (const char* folder :
       {"solver", "reference", "calibration", "reports", "app", "cmake", "tests"})
    for (const auto& entry : fs::recursive_directory_iterator(kCheckout / folder)) {
      if (!entry.is_regular_file()) continue;
      ++files;
      EXPECT_EQ(entry.path().string().find(mark), std::string::npos) << entry.path();
      EXPECT_EQ(text_of(entry.path()).find(mark), std::string::npos) << entry.path();
    }
  EXPECT_GT(files, 200u);
}

}  // namespace
}  // namespace truebox

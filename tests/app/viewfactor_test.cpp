// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "radiometry/table_file.h"
#include "support/run_command.h"
#include "support/scratch.h"
#include "verification/view_factor_scenes.h"

namespace truebox {
namespace {

using testing::HasSubstr;

using Outcome = CommandOutcome;

Outcome program(const std::string& arguments) {
  return run_command("'" TRUEBOX_PROGRAM "' " + arguments);
}

Outcome viewfactor(const std::string& arguments) { return program("viewfactor " + arguments); }

void write_vertices(std::ostream& out, const Polygon& polygon) {
  out << '[';
  for (const Vec3& v : polygon)
    out << (&v == &polygon[0] ? "[" : ", [") << v.x() << ", " << v.y() << ", " << v.z() << ']';
  out << ']';
}

// One [[surfaces]] an outline; parts of one surface get numbers behind its name.
std::string write_scene(const std::string& name, const std::vector<SceneOutline>& outlines) {
  const std::string path = scratch_path(name + ".toml");
  std::ofstream out(path);
  out.precision(17);
  out << "length_unit = \"m\"\n[materials.black]\nreflectance = 0\n";
  int number = 0;
  for (const SceneOutline& part : outlines) {
    out << "[[surfaces]]\nname = \"" << part.name << '.' << number++
        << "\"\nmaterial = \"black\"\nvertices = ";
    write_vertices(out, part.outline);
    if (!part.holes.empty()) {
      out << "\nholes = [";
      for (const Polygon& hole : part.holes) write_vertices(out, hole);
      out << ']';
    }
    out << '\n';
  }
  return path;
}

double area_of(const SceneOutline& part) {
  double area = area_vector(part.outline).norm();
  for (const Polygon& hole : part.holes) area -= area_vector(hole).norm();
  return area;
}

class ViewFactorCommand : public testing::TestWithParam<CertifiedScene> {};

TEST_P(ViewFactorCommand, FindsTheCertifiedValueWithinItsBound) {
  const CertifiedScene& row = GetParam();
  const std::string csv = scratch_path(row.name + ".csv");
  const Outcome outcome = viewfactor(write_scene(row.name, row.outlines) + " -o " + csv);
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  const TableFile table = read_table(csv);
  ASSERT_EQ(table.columns,
            (std::vector<std::string>{"from", "to", "view_factor", "error_bound", "method"}));
  double exchange = 0.0, bound = 0.0, area = 0.0;
  for (std::size_t k = 0; k < row.outlines.size(); ++k) {
    if (row.outlines[k].name != "A1") continue;
    const std::string name = "A1." + std::to_string(k);
    const double part = area_of(row.outlines[k]);
    area += part;
    for (std::size_t line = 0; line < table.rows.size(); ++line)
      if (table.rows[line][0] == name && table.rows[line][1].starts_with("A2")) {
        exchange += part * table.number(line, 2);
        bound += part * table.number(line, 3);
      }
  }
  const double factor = exchange / area, model = row.relative_model_error * row.view_factor;
  // The reader rounds decimal vertices, the writer keeps 15 digits: together below 1e-14.
  EXPECT_NEAR(factor, row.view_factor, bound / area + model + 1e-14);
  EXPECT_LT(bound / area, 1e-9 * row.view_factor + (model > 0.0 ? 1e-4 : 0.0));
}

INSTANTIATE_TEST_SUITE_P(Rows, ViewFactorCommand,
                         testing::ValuesIn(view_factor_scenes(TRUEBOX_REFERENCE_DIR, 32)),
                         [](const auto& row) {
                           std::string name;
                           for (char c : row.param.name) name += std::isalnum(c) ? c : '_';
                           return name;
                         });

const std::vector<SceneOutline> kTwoPlates = {
    {"low", {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {}},
    {"high", {{0, 1, 1}, {1, 1, 1}, {1, 0, 1}, {0, 0, 1}}, {}},
    {"between", {{0, 0, 0.5}, {0.5, 0, 0.5}, {0.5, 0.5, 0.5}, {0, 0.5, 0.5}}, {}}};

TEST(ViewFactorProgram, NamesTheMethodOfEachPair) {
  const auto outcome = viewfactor(write_scene("plates", kTwoPlates));
  EXPECT_EQ(outcome.code, 0);
  EXPECT_THAT(outcome.text, HasSubstr("from,to,view_factor,error_bound,method\n"));
  EXPECT_THAT(outcome.text, testing::ContainsRegex("\"low.0\",\"high.1\",0.1498686.*,exact-vis"));
  EXPECT_THAT(outcome.text, testing::ContainsRegex("\"high.1\",\"between.2\",0.*,analytic"));
}

TEST(ViewFactorProgram, TakesEachMethodByName) {
  const std::string scene = write_scene("methods", kTwoPlates);
  for (const char* method :
       {"analytic", "exact-visibility", "ray-casting", "planned", "nusselt", "hemicube"}) {
    const auto outcome =
        viewfactor(scene + " --from low.0 --to high.1 --rays 256 --method " + method);
    EXPECT_EQ(outcome.code, 0) << method;
    EXPECT_THAT(outcome.text, testing::ContainsRegex("\"low.0\",\"high.1\",0.1")) << method;
    EXPECT_THAT(outcome.text, testing::Not(HasSubstr("between"))) << method;
  }
}

TEST(ViewFactorProgram, DrawsNusseltsPicture) {
  const std::string plot = scratch_path("nusselt.svg");
  const std::string scene = write_scene("picture", kTwoPlates);
  EXPECT_EQ(viewfactor(scene + " --from low.0 --to high.1 --nusselt-plot " + plot).code, 0);
  std::ifstream file(plot);
  const std::string svg{std::istreambuf_iterator<char>(file), {}};
  EXPECT_THAT(svg, HasSubstr("<circle"));
  EXPECT_THAT(svg, HasSubstr("<polygon"));
  EXPECT_EQ(viewfactor(scene + " --nusselt-plot " + plot).code, 4) << "all pairs have no picture";
}

TEST(ViewFactorProgram, SweepsEveryMethodOnTheSamePairs) {
  const std::string scene = write_scene("swept", kTwoPlates), json = scratch_path("sweep.json");
  const auto outcome = program("sweep " + scene + " --of viewfactors --time-limit 0.2 --json " +
                               json + " --plot " + scratch_path("sweep.svg"));
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  for (const char* method : {"planned", "exact-visibility", "ray-casting", "nusselt", "hemicube"})
    EXPECT_THAT(outcome.text, HasSubstr(method));
  EXPECT_THAT(outcome.text, HasSubstr("front"));
  std::ifstream file(json);
  const auto sweep = nlohmann::json::parse(file);
  for (const auto& point : sweep["points"])
    if (point["method"] == "exact-visibility" || point["method"] == "planned") {
      EXPECT_EQ(point["bound_held"], 1.0) << point;
    }
  EXPECT_EQ(program("sweep " + scene + " --of nothing").code, 64);
}

TEST(ViewFactorProgram, RefusesWhatItCannotDo) {
  const std::string scene = write_scene("refused", kTwoPlates);
  EXPECT_EQ(viewfactor(scene + " --method guess").code, 64);
  EXPECT_EQ(viewfactor(scene + " --tolerance 0").code, 64);
  const auto unknown = viewfactor(scene + " --from nowhere");
  EXPECT_EQ(unknown.code, 4);
  EXPECT_THAT(unknown.text, HasSubstr("\"nowhere\""));
  EXPECT_EQ(viewfactor("missing.toml").code, 4);
  const auto flat = viewfactor(
      write_scene("flat", {{"line", {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {}}, kTwoPlates[0]}));
  EXPECT_EQ(flat.code, 4);
  EXPECT_THAT(flat.text, HasSubstr("a polygon with an area"));
  const auto bow_tie = viewfactor(write_scene(
      "bow_tie", {{"tie", {{0, 0, 0}, {2, 2, 0}, {2, 0, 0}, {0, 1, 0}}, {}}, kTwoPlates[1]}));
  EXPECT_EQ(bow_tie.code, 4);
  EXPECT_THAT(bow_tie.text, HasSubstr("does not cross itself"));
}

}  // namespace
}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "export/solution_files.h"

#include <gmock/gmock.h>

#include <array>
#include <fstream>
#include <map>
#include <optional>
#include <set>

#include "export/solution_surface.h"
#include "mesh/hanging_vertices.h"
#include "solver/export/glb_reader.h"
#include "support/run_command.h"
#include "support/scratch.h"
#include "support/tiny_scenes.h"

namespace truebox {
namespace {

Observer observer() {
  return read_observer(std::string(TRUEBOX_REFERENCE_DIR) + "/colour/cie1931_2deg_xyz.csv",
                       "CIE 1931 2 deg");
}

Prediction solved(const Scene& scene, std::size_t elements) {
  PredictOptions options;
  options.elements = elements;
  return {scene, options};
}

// Closed, rho = 1/2, E = 1 everywhere: B = 2. All grids agree on it, so the bound is next to
// nothing; what is left is the quadrature of view factors, which closes rows to about 1e-8.
TEST(SolutionSurface, OfAFurnaceIsTwoWithinItsBound) {
  const Scene scene = tiny::cube(1.0, 0.5, 1.0);
  const Prediction prediction = solved(scene, 600);
  const SolutionSurface surface = solution_surface(prediction);
  ASSERT_EQ(surface.radiosity.rows(), static_cast<Eigen::Index>(surface.positions_m.size()));
  for (Eigen::Index v = 0; v < surface.radiosity.rows(); ++v)
    EXPECT_NEAR(surface.radiosity(v, 0), 2.0, surface.error_bound(v, 0) + 1e-7);
  double area_m2 = 0.0;
  for (std::size_t t = 0; t < surface.triangles.size(); t += 3) {
    const auto at = [&](std::size_t k) { return surface.positions_m[surface.triangles[t + k]]; };
    area_m2 += 0.5 * (at(1) - at(0)).cross(at(2) - at(0)).norm();
  }
  EXPECT_NEAR(area_m2, 6.0, 1e-12);
  // Continuous on every face: no vertex of a face stands twice in one place.
  std::set<std::tuple<std::uint32_t, double, double, double>> places;
  std::set<std::uint32_t> vertices;
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const std::uint32_t v = surface.triangles[t];
    const Vec3& p = surface.positions_m[v];
    if (vertices.insert(v).second) {
      EXPECT_TRUE(places.insert({surface.surface[t / 3], p.x(), p.y(), p.z()}).second);
    }
  }
}

// Under a block nothing is drawn; along its foot the floor has two values, lit and dark.
TEST(SolutionSurface, LeavesOutWhatLiesUnderABlock) {
  const Scene scene = tiny::cube_with_block(1.0, 0.5, 1.0);
  const SolutionSurface surface = solution_surface(solved(scene, 900));
  double floor_m2 = 0.0;
  for (std::size_t t = 0; t < surface.surface.size(); ++t) {
    if (surface.surface[t] != 0) continue;
    const auto at = [&](std::size_t k) {
      return surface.positions_m[surface.triangles[3 * t + k]];
    };
    floor_m2 += 0.5 * (at(1) - at(0)).cross(at(2) - at(0)).norm();
  }
  EXPECT_NEAR(floor_m2, 1.0 - 0.27 * 0.29, 1e-9);
}

// Lines of contact end inside elements, whose neighbours' corners hang in their edges: those are
// vertices of both, so that no vertex lies inside an edge of a triangle.
TEST(SolutionSurface, HasNoCracksWhereLargerElementsMeetSmallerOnes) {
  const Scene scene = tiny::cube_with_block(1.0, 0.5, 1.0);
  const Prediction prediction = solved(scene, 300);
  ASSERT_FALSE(hanging_vertices(prediction.fine().mesh).empty());
  const SolutionSurface surface = solution_surface(prediction);
  const auto& at = surface.positions_m;
  std::size_t inside = 0;
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const Vec3& a = at[surface.triangles[t]];
    const Vec3& b = at[surface.triangles[t % 3 == 2 ? t - 2 : t + 1]];
    for (std::size_t u = 0; u < surface.triangles.size(); ++u) {
      if (surface.surface[u / 3] != surface.surface[t / 3]) continue;
      const Vec3 x = at[surface.triangles[u]] - a, along = (b - a).normalized();
      const double t_m = along.dot(x);
      inside += t_m > 1e-6 && t_m < (b - a).norm() - 1e-6 && (x - t_m * along).norm() < 1e-7;
    }
  }
  EXPECT_EQ(inside, 0u);
}

// What a command says of a file that stands in `$1`; nothing where its tool is not installed.
std::optional<std::string> judged(const std::string& tool_is_there, const std::string& command,
                                  const std::string& name, const std::string& content) {
  if (run_command(tool_is_there).code != 0) return std::nullopt;
  const std::string path = scratch_path(name);
  std::ofstream(path, std::ios::binary) << content;
  const CommandOutcome outcome = run_command(command + " '" + path + "'");
  return std::to_string(outcome.code) + " " + outcome.text;
}

// Debian's python3-vtk9 reads it as ParaView does.
TEST(SolutionVtu, IsReadByVtkWithItsCellsAndBands) {
  const Scene scene = tiny::cube_with_block(1.0, 0.5, 1.0);
  const Prediction prediction = solved(scene, 200);
  const auto said = judged("/usr/bin/python3 -c 'from vtkmodules import vtkIOXML'",
                           "/usr/bin/python3 -c \"import sys\n"
                           "from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader\n"
                           "reader = vtkXMLUnstructuredGridReader()\n"
                           "reader.SetFileName(sys.argv[1])\n"
                           "reader.Update()\n"
                           "grid = reader.GetOutput()\n"
                           "b = grid.GetCellData().GetArray('radiosity_W_m-2_nm-1')\n"
                           "print(reader.GetErrorCode(), grid.GetNumberOfCells(), "
                           "b.GetNumberOfTuples(), b.GetNumberOfComponents(), "
                           "round(b.GetTuple1(0), 3))\"",
                           "solution.vtu", solution_vtu(prediction));
  if (!said) GTEST_SKIP() << "python3-vtk9 is not installed";
  const std::string cells = std::to_string(prediction.fine().mesh.size());
  EXPECT_EQ(*said, "0 0 " + cells + " " + cells + " 1 2.0\n");
}

// Khronos' own validator (npm's gltf-validator), where $TRUEBOX_GLTF_VALIDATOR is its folder.
TEST(SolutionGlb, HasNoFaultForTheValidator) {
  const Scene scene = tiny::cube_with_block(1.0, 0.5, 1.0);
  const auto said =
      judged("test -d \"$TRUEBOX_GLTF_VALIDATOR\" && node --version",
             "node -e \"require(process.env.TRUEBOX_GLTF_VALIDATOR)"
             ".validateBytes(new Uint8Array(require('fs').readFileSync(process.argv[1])))"
             ".then(r => console.log(r.issues.numErrors, r.issues.numWarnings, "
             "r.issues.messages.slice(0, 3).map(m => m.message)))\"",
             "solution.glb", solution_glb(solved(scene, 200), observer()));
  if (!said) GTEST_SKIP() << "no gltf-validator in $TRUEBOX_GLTF_VALIDATOR";
  EXPECT_EQ(said->substr(0, 5), "0 0 0") << *said;
}

// In a closed scene every edge of a triangle is one of another triangle, backwards, on another wall
// as well: where the places differ in one bit only, a viewer shows specks of its background.
TEST(SolutionSurface, OfAClosedSceneIsWatertightToTheLastBit) {
  const Scene scene = tiny::cube_with_block(1.0, 0.5, 1.0);
  const SolutionSurface surface = solution_surface(solved(scene, 300));
  using Place = std::array<float, 3>;
  std::map<std::pair<Place, Place>, int> once;
  const auto place = [&](std::size_t t) {
    const Vec3& p = surface.positions_m[surface.triangles[t]];
    return Place{static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
  };
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const Place a = place(t), b = place(t % 3 == 2 ? t - 2 : t + 1);
    ASSERT_NE(a, b);
    if (const auto back = once.find({b, a}); back == once.end())
      ++once[{a, b}];
    else if (--back->second == 0)
      once.erase(back);
  }
  EXPECT_EQ(once.size(), 0u) << "edges without another side";
}

TEST(SolutionGlb, HoldsTheSurfaceAndKeepsTheSpecification) {
  const Scene scene = tiny::cube(1.0, 0.5, 1.0);
  const Prediction prediction = solved(scene, 200);
  const Glb glb = read_glb(solution_glb(prediction, observer()));
  EXPECT_EQ(glb.json["meshes"].size(), 6u);
  std::size_t vertices = 0;
  for (const auto& mesh : glb.json["meshes"]) {
    const auto& attributes = mesh["primitives"][0]["attributes"];
    for (const float b : glb.floats(attributes["_RADIOSITY_550_000NM"]))
      EXPECT_NEAR(b, 2.0f, 2e-2f);
    for (const float c : glb.floats(attributes["COLOR_0"])) EXPECT_TRUE(c >= 0.0f && c <= 1.0f);
    EXPECT_EQ(attributes.count("_ERROR_BOUND_550_000NM"), 1u);
    vertices += glb.floats(attributes["POSITION"]).size() / 3;
  }
  EXPECT_EQ(vertices, solution_surface(prediction).positions_m.size());
  EXPECT_EQ(glb.json["extensionsUsed"][0], "KHR_materials_unlit");
}

}  // namespace
}  // namespace truebox

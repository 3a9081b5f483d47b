// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "adaptive/adaptive_solution.h"
#include "support/cornell_box.h"
#include "support/tiny_scenes.h"
#include "verification/accuracy_check.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr std::size_t kFloor = 0;

// Cube of reflectance 0.8 whose ceiling shines; certified continuum means in ceiling_lit_cube.csv.
Scene lit_cube() {
  Scene scene = tiny::cube(1.0, 0.8);
  scene.materials.push_back({"lamp", Reflectance(1, 0.8), RadiantExitance(1, 1.0)});
  scene.surfaces[1].material = 1;
  return scene;
}

std::vector<std::size_t> cells_of_surfaces(const CellTree& cells, const Scene& scene) {
  std::vector<std::size_t> count(scene.surfaces.size(), 0);
  const PatchMesh mesh = cells.mesh(0);
  for (const Patch& patch : mesh.patches) ++count[mesh.surface_of(patch)];
  return count;
}

TEST(AdaptMesh, LowersTheIndicatedErrorAtEveryStep) {
  const Scene scene = cornell_box_in_seven_bands();
  AdaptOptions options;
  options.cells = 400;
  const AdaptedMesh adapted = adapt_mesh(scene, options);
  ASSERT_GE(adapted.steps.size(), 3u);
  for (std::size_t k = 1; k < adapted.steps.size(); ++k) {
    EXPECT_GT(adapted.steps[k].cells, adapted.steps[k - 1].cells);
    EXPECT_LT(adapted.steps[k].indicated_error, adapted.steps[k - 1].indicated_error);
  }
  EXPECT_EQ(adapted.fine.size(), options.cells);
  EXPECT_LE(4 * adapted.coarse.size(), options.cells);
}

TEST(AdaptMesh, PutsElementsWhereTheGoalLooks) {
  Scene scene = tiny::cube_with_block(1.0, 0.5);
  scene.materials.push_back({"lamp", Reflectance(1, 0.5), RadiantExitance(1, 1.0)});
  scene.surfaces[1].material = 1;
  AdaptOptions options;
  options.cells = 300;
  const auto everywhere = cells_of_surfaces(adapt_mesh(scene, options).fine, scene);
  // A camera at the ceiling that looks down sees the floor; at the ceiling nothing counts but what
  // it sends.
  CameraDescription down;
  down.position_m = {0.5, 0.5, 0.99};
  down.direction = -Vec3::UnitZ();
  down.up = Vec3::UnitY();
  down.pixels = {64, 64};
  options.goal = image_goal(scene, Camera(down));
  const auto image = cells_of_surfaces(adapt_mesh(scene, options).fine, scene);
  EXPECT_GT(static_cast<double>(image[kFloor]) / static_cast<double>(image[1]),
            static_cast<double>(everywhere[kFloor]) / static_cast<double>(everywhere[1]));
}

TEST(AdaptMesh, NamesTheGoalsThereAre) {
  const Scene scene = lit_cube();
  try {
    goal_of_name("surface:roof", scene);
    FAIL() << "no such surface";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("surface:roof"));
    EXPECT_THAT(error.what(), testing::HasSubstr("surface:cube 5"));
  }
}

TEST(PredictAdaptively, HoldsItsBoundOnCertifiedMeansAndServesItsGoal) {
  const Scene scene = lit_cube();
  PredictOptions options;
  options.elements = 800;
  double floor_error = 0.0;
  for (const char* goal : {"everywhere", "surface:cube 0"}) {
    const auto prediction = predict_adaptively(scene, options, goal_of_name(goal, scene));
    ASSERT_EQ(prediction->outcome(), SolveOutcome::converged);
    ASSERT_TRUE(prediction->bound_is_reliable());
    // ceiling_lit_cube.csv: mean B of floor and wall 0.660979, 0.68787875 and, less its own 1, of
    // the ceiling 0.587506; each is reflected, so irradiance is B / 0.8.
    const double certified[] = {0.660979 / 0.8, 0.587506 / 0.8, 0.68787875 / 0.8};
    const BandMatrix bound = prediction->surface_irradiance_bound();
    const BandMatrix irradiance = prediction->irradiance();
    double sum[3] = {};
    const PatchMesh& mesh = prediction->fine().mesh;
    for (std::size_t i = 0; i < mesh.size(); ++i)
      if (const std::size_t s = mesh.surface_of(mesh.patches[i]); s < 3)
        sum[s] += mesh.patches[i].area_m2 * irradiance(static_cast<Index>(i), 0);
    for (Index s = 0; s < 3; ++s) {
      std::printf("%s: mean of face %d off by %.2g, bound %.2g\n", goal, static_cast<int>(s),
                  sum[s] - certified[s], bound(s, 0));
      EXPECT_NEAR(sum[s], certified[s], bound(s, 0) + 1e-6);
      EXPECT_LT(bound(s, 0), 0.02 * certified[s]);
    }
    // A mesh for the floor knows the floor better: ten times was seen, twice is asked for.
    if (floor_error > 0.0) {
      EXPECT_LT(std::abs(sum[0] - certified[0]), 0.5 * floor_error);
    }
    floor_error = std::abs(sum[0] - certified[0]);
  }
}

TEST(PredictAdaptively, HoldsItsBoundAtPathTracedPointsOfTheCornellBox) {
  const Scene scene = cornell_box_in_seven_bands();
  PredictOptions options;
  options.elements = 1500;
  const auto prediction = predict_adaptively(scene, options, {});
  ASSERT_EQ(prediction->outcome(), SolveOutcome::converged);
  std::size_t outside = 0;
  const auto checks = check_cornell_box_probes(TRUEBOX_REFERENCE_DIR, *prediction);
  ASSERT_GT(checks.size(), 200u);
  for (const AccuracyCheck& check : checks) outside += !check.passed();
  // Own bound and 3 standard errors: noise alone puts 0.3 % of them outside.
  EXPECT_LE(static_cast<double>(outside), 0.01 * static_cast<double>(checks.size()));
}

}  // namespace
}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "adaptive/adaptive_solution.h"
#include "support/cornell_box.h"
#include "support/irradiance_truth.h"
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
    EXPECT_THAT(error.what(), testing::HasSubstr("parameter:grey"));
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

// Rms irradiance of the field, over the area, against gathered irradiance, with 384 elements each:
// sizes that shrink towards edges follow c x^lambda there.
TEST(CellTree, HalvesTheRmsErrorOfUniformElementsByGradingThemTowardsEdges) {
  const Scene scene = lit_cube();
  auto places = places_on_surfaces(scene, 0.25);
  auto other = places;
  gather_truth(*solve_truth(scene, 1.0), other);
  gather_truth(*solve_truth(scene, 0.5), places);
  const FieldError of_truth = rms_error(places, [&](std::size_t i) -> Eigen::VectorXd {
    return places[i].indirect - other[i].indirect;
  });
  const CellTree cells(scene, 0.5);
  PredictOptions options;
  options.mesh_of_grid = [&](int grid) { return uniform_mesh(scene, 0.5, grid); };
  const Prediction uniform(scene, options);
  options.mesh_of_grid = [&](int grid) { return cells.mesh(grid); };
  const Prediction graded(scene, options);
  ASSERT_EQ(graded.fine().mesh.size(), uniform.fine().mesh.size());
  const FieldError of_uniform = field_error(uniform, places),
                   of_graded = field_error(graded, places);
  std::printf("%zu places, two truths %.2g %%; uniform %.3g %%, graded %.3g %%\n", places.size(),
              100.0 * of_truth.to_mean, 100.0 * of_uniform.to_mean, 100.0 * of_graded.to_mean);
  EXPECT_LT(of_truth.to_mean, 0.25 * of_graded.to_mean);  // so that the truth may judge
  EXPECT_LT(of_graded.to_mean, 0.6 * of_uniform.to_mean);
}

// A room with a red wall: floor 0, ceiling 1 (lamp), walls 2 to 5 of which 5 is red.
Scene room_with_red_wall(double red = 0.5) {
  Scene scene = tiny::cube(1.0, 0.7);
  scene.materials.push_back({"lamp", Reflectance(1, 0.7), RadiantExitance(1, 1.0)});
  scene.materials.push_back({"red", Reflectance(1, red), RadiantExitance(1, 0.0)});
  scene.surfaces[1].material = 1;
  scene.surfaces[5].material = 2;
  return scene;
}

// Mean irradiance of each element of a mesh as another prediction knows it; 0 where nothing is lit.
Eigen::VectorXd means_over(const PatchMesh& mesh, const Prediction& prediction) {
  Eigen::VectorXd means = Eigen::VectorXd::Zero(static_cast<Index>(mesh.size()));
  Polygon polygon;
  for (std::size_t i = 0; i < mesh.size(); ++i) {
    mesh.polygon_of(mesh.patches[i], polygon);
    if (const auto mean = prediction.mean_irradiance_over(polygon))
      means[static_cast<Index>(i)] = mean->value[0];
  }
  return means;
}

// What a least-squares fit of the red wall's reflectance to relative radiosities makes of a
// prediction's errors; lamps are not observed.
double fitted_error(const Prediction& prediction, const Prediction& truth, const Prediction& dim,
                    const Prediction& bright, double ln_change) {
  const PatchMesh& mesh = prediction.fine().mesh;
  const Eigen::VectorXd exact = means_over(mesh, truth), less = means_over(mesh, dim),
                        more = means_over(mesh, bright);
  double change = 0.0, square = 0.0;
  for (std::size_t i = 0; i < mesh.size(); ++i) {
    const auto row = static_cast<Index>(i);
    const Surface& surface = prediction.scene().surfaces[mesh.surface_of(mesh.patches[i])];
    if (surface.material == 1 || !prediction.fine().usable[i] || exact[row] <= 0.0) continue;
    const double own = surface.material == 2 ? 1.0 : 0.0;
    const double s = own + std::log(more[row] / less[row]) / ln_change;
    const double computed = prediction.fine().direct(row, 0) + prediction.fine().indirect(row, 0);
    change += mesh.patches[i].area_m2 * s * (computed / exact[row] - 1.0);
    square += mesh.patches[i].area_m2 * s * s;
  }
  return change / square;
}

TEST(PredictAdaptively, ServesAFittedReflectance) {
  const Scene scene = room_with_red_wall(), brighter = room_with_red_wall(0.55);
  PredictOptions options;
  options.form_factors.method = FormFactorMethod::exact_visibility;
  options.elements = 3000;
  const Prediction truth(scene, options);
  options.elements = 500;
  const Prediction dim(scene, options), bright(brighter, options);
  options.elements = 600;
  std::vector<double> error;
  for (const char* goal : {"everywhere", "parameter:red"}) {
    const auto prediction = predict_adaptively(scene, options, goal_of_name(goal, scene));
    error.push_back(std::abs(fitted_error(*prediction, truth, dim, bright, std::log(0.55 / 0.5))));
    std::printf("%s: a fit finds the red wall's reflectance off by %.2g %%\n", goal,
                100.0 * error.back());
  }
  EXPECT_LT(error[1], 0.75 * error[0]);  // two thirds was seen
}

TEST(InverseIrradiance, OfRmsIrradianceIsOneOverTheMeanEverywhere) {
  const Scene scene = lit_cube();
  const PatchMesh mesh = uniform_mesh(scene, 0.5);
  const auto n = static_cast<Index>(mesh.size());
  BandMatrix irradiance(n, 1);
  for (Index i = 0; i < n; ++i) irradiance(i, 0) = i % 2 == 0 ? 1.5 : 0.5;  // equal areas
  const std::vector<char> counts(mesh.size(), 1);
  const BandMatrix absolute =
      inverse_irradiance(goal_of_name("irradiance", scene), mesh, counts, irradiance);
  const BandMatrix relative = inverse_irradiance({}, mesh, counts, irradiance);
  for (Index i = 0; i < n; ++i) {
    EXPECT_NEAR(absolute(i, 0), 1.0, 1e-14);
    EXPECT_NEAR(relative(i, 0), 1.0 / irradiance(i, 0), 1e-14);
  }
}

TEST(DualSource, OfAParameterReadsBackAChangeOfItsReflectance) {
  const Scene scene = room_with_red_wall();
  const PatchMesh mesh = uniform_mesh(scene, 0.25);
  const auto n = static_cast<Index>(mesh.size());
  const std::vector<char> counts(mesh.size(), 1);
  BandMatrix irradiance(n, 1), sensitivity(n, 1);
  for (Index i = 0; i < n; ++i) {
    irradiance(i, 0) = 1.0 + 0.1 * static_cast<double>(i % 7);
    sensitivity(i, 0) = 0.3 * static_cast<double>(i % 5);  // dB / d ln rho_m : rho_i
  }
  const SmoothField places(mesh, counts, irradiance);
  std::mt19937_64 random(1);
  const BandMatrix q = dual_source(goal_of_name("parameter:red", scene), mesh, counts, irradiance,
                                   places, sensitivity, random);
  double change = 0.0;  // what a reflectance larger by 1 % does to every B_i, seen as dE_i
  for (Index i = 0; i < n; ++i)
    change +=
        mesh.patches[static_cast<std::size_t>(i)].area_m2 * q(i, 0) * 0.01 * sensitivity(i, 0);
  EXPECT_NEAR(change, 0.01, 1e-14);
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

// Elements that follow lines of light: triangles and quads of any shape.
TEST(PredictAlongDiscontinuities, HoldsItsBoundAtPathTracedPointsOfTheCornellBox) {
  const Scene scene = cornell_box_in_seven_bands();
  PredictOptions options;
  options.elements = 1500;
  options.form_factors.method = FormFactorMethod::exact_visibility;
  FollowedLines followed;
  const auto prediction = predict_along_discontinuities(scene, options, &followed);
  ASSERT_EQ(prediction->outcome(), SolveOutcome::converged);
  EXPECT_GT(followed.of_order[2], 20u);
  std::size_t outside = 0;
  const auto checks = check_cornell_box_probes(TRUEBOX_REFERENCE_DIR, *prediction);
  for (const AccuracyCheck& check : checks) outside += !check.passed();
  EXPECT_LE(static_cast<double>(outside), 0.01 * static_cast<double>(checks.size()));
}

}  // namespace
}  // namespace truebox

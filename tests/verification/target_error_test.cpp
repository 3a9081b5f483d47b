// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "support/tiny_scenes.h"
#include "transport/predict_to_target.h"

namespace truebox {
namespace {

using Eigen::Index;

// Cube of reflectance 0.8 whose ceiling shines: no closed form at a point, but energy balances:
// the mean irradiance of all faces is E / (6 (1 - rho)), E on one face.
Scene lit_cube() {
  Scene scene = tiny::cube(1.0, 0.8);
  scene.materials.push_back({"lamp", Reflectance(1, 0.8), RadiantExitance(1, 1.0)});
  scene.surfaces[1].material = 1;
  return scene;
}

// Certified continuum means, ceiling_lit_cube.csv: B of floor and wall 0.660979, 0.68787875;
// irradiance B / rho, and (B - 1) / rho on the ceiling, 1.587506.
double certified_mean(std::size_t face) {
  return (face == 0 ? 0.660979 : face == 1 ? 0.587506 : 0.68787875) / 0.8;
}

TEST(TargetError, IsMetByTheBoundAndByTheTruth) {
  const Scene scene = lit_cube();
  PredictOptions options;
  options.elements = 300;
  for (const double target : {0.02, 0.002}) {
    const TargetedPrediction found = predict_to_target(scene, options, target);
    ASSERT_TRUE(found.is_reached);
    EXPECT_LE(largest_relative_bound(*found.prediction), target);
    const SurfaceMeans means = found.prediction->surface_means();
    for (std::size_t s = 0; s < 6; ++s)
      EXPECT_NEAR(means.irradiance(static_cast<Index>(s), 0), certified_mean(s),
                  target * certified_mean(s))
          << s;
    std::printf("target %.3g: %zu attempts, %zu elements, bound %.3g\n", target, found.steps.size(),
                found.steps.back().elements, found.steps.back().relative_bound);
  }
}

Scene blocked_room(double rho) {
  Scene scene = tiny::cube_with_block(1.0, rho);
  scene.materials.push_back({"lamp", Reflectance(1, rho), RadiantExitance(1, 1.0)});
  scene.surfaces[1].material = 1;
  return scene;
}

// A matrix costs the square of its elements: all attempts together against the last.
TEST(TargetError, CostsLittleMoreThanTheSolveThatMeetsIt) {
  PredictOptions options;
  options.elements = 550;
  const Scene scene = blocked_room(0.8);
  for (const double target : {0.005, 0.0015}) {
    const TargetedPrediction found = predict_to_target(scene, options, target);
    ASSERT_TRUE(found.is_reached);
    double all = 0.0;
    for (const TargetStep& step : found.steps) all += std::pow(step.elements, 2);
    const double ratio = all / std::pow(found.steps.back().elements, 2);
    std::printf("target %.3g: %zu attempts, %zu elements, bound %.3g (%s), cost %.2f\n", target,
                found.steps.size(), found.steps.back().elements, found.steps.back().relative_bound,
                found.steps.back().where.c_str(), ratio);
    EXPECT_LE(ratio, 1.5);
    EXPECT_GT(found.steps.back().relative_bound, 0.3 * target) << "far finer than needed";
  }
}

TEST(TargetError, IsRefusedBeforeAnythingLargeIsSolvedWhereMemoryEndsFirst) {
  PredictOptions options;
  options.elements = 300;
  options.form_factors.memory_limit_bytes = 1000 * 1000 * sizeof(double);
  const Scene scene = lit_cube();
  const TargetedPrediction found = predict_to_target(scene, options, 1e-6);
  EXPECT_FALSE(found.is_reached);
  EXPECT_EQ(found.prediction->outcome(), SolveOutcome::converged);
  ASSERT_EQ(found.steps.size(), 1u);
  EXPECT_EQ(found.elements_that_fit, 1000.0);
  EXPECT_GT(found.elements_needed, 1e5);
  // What would be possible: between the first attempt's bound and the target, and true.
  EXPECT_LT(found.bound_that_fits, found.steps[0].relative_bound);
  options.elements = 900;
  const Prediction possible(scene, options);
  EXPECT_LT(largest_relative_bound(possible), 2.0 * found.bound_that_fits);
}

TEST(TargetError, RefusesWhatIsNoShare) {
  for (const double bad : {0.0, 1.0, -0.1, std::nan("")})
    EXPECT_THROW(predict_to_target(lit_cube(), {}, bad), std::invalid_argument);
}

TEST(ErrorShares, OfAnUnoccludedCubeAreDiscretisation) {
  // Nothing is sampled in a cube: two samplings differ by nothing, and the solver was told 1e-7.
  PredictOptions options;
  options.elements = 600;
  options.error_shares = true;
  const Scene scene = lit_cube();
  const auto shares = Prediction(scene, options).error_shares();
  ASSERT_TRUE(shares);
  EXPECT_LT(shares->form_factors, 1e-6);  // twice the solver's bound
  EXPECT_LT(shares->solver, 1e-5);
  EXPECT_GT(shares->discretisation, 1e-4);
  EXPECT_LT(shares->discretisation, 0.05);
  EXPECT_FALSE(Prediction(scene, {.elements = 100}).error_shares());
}

TEST(ErrorShares, OfABlockedCubeKnowOfItsRays) {
  Scene scene = tiny::cube_with_block(1.0, 0.7);
  scene.materials.push_back({"lamp", Reflectance(1, 0.7), RadiantExitance(1, 1.0)});
  scene.surfaces[1].material = 1;
  PredictOptions few, many;
  few.form_factors.method = many.form_factors.method = FormFactorMethod::ray_casting;
  few.elements = many.elements = 800;
  few.error_shares = many.error_shares = true;
  few.form_factors.rays = 4;
  many.form_factors.rays = 256;
  const auto rough = Prediction(scene, few).error_shares(),
             smooth = Prediction(scene, many).error_shares();
  EXPECT_GT(rough->form_factors, 1e-5);
  // 64 times the rays: 8 times less noise if random, more with low discrepancy.
  EXPECT_LT(smooth->form_factors, 0.4 * rough->form_factors);
  EXPECT_NEAR(smooth->discretisation, rough->discretisation, 0.2 * rough->discretisation);
}

TEST(RadiosityByReflectance, IsThatOfADifference) {
  Scene scene = lit_cube();
  scene.materials.push_back({"paint", Reflectance(1, 0.4), RadiantExitance(1, 0.0)});
  scene.surfaces[2].material = 2;
  PredictOptions options;
  options.elements = 400;
  options.sensitivities = true;
  options.solve.relative_bound = 1e-10;
  const auto derivative = Prediction(scene, options).radiosity_by_reflectance();
  ASSERT_EQ(derivative.size(), 3u);
  constexpr double kStep = 1e-3;
  std::array<std::vector<double>, 2> mean;
  for (int side = 0; side < 2; ++side) {
    scene.materials[2].reflectance[0] = 0.4 + (side == 0 ? -kStep : kStep);
    const Prediction moved(scene, options);
    const BandMatrix b = moved.radiosity();
    mean[side].assign(6, 0.0);
    for (std::size_t i = 0; i < moved.fine().mesh.size(); ++i)
      mean[side][moved.fine().mesh.surface_of(moved.fine().mesh.patches[i])] +=
          moved.fine().mesh.patches[i].area_m2 * b(static_cast<Index>(i), 0);
  }
  for (std::size_t s = 0; s < 6; ++s)
    // Central difference: step^2 of the third derivative, below 10; solver 1e-10 / step.
    EXPECT_NEAR(derivative[2](static_cast<Index>(s), 0), (mean[1][s] - mean[0][s]) / (2.0 * kStep),
                10.0 * kStep * kStep + 1e-6)
        << s;
}

TEST(SurfaceMeans, AreWithinTheirBoundOfCertifiedOnesAndCloserThanTheFinestGridAlone) {
  const Scene scene = lit_cube();
  for (const std::size_t elements : {300u, 900u, 2000u}) {
    PredictOptions options;
    options.elements = elements;
    const Prediction prediction(scene, options);
    const SurfaceMeans means = prediction.surface_means();
    const BandMatrix irradiance = prediction.irradiance(),
                     of_finest = prediction.surface_irradiance_bound();
    const PatchMesh& mesh = prediction.fine().mesh;
    std::array<double, 6> finest{};
    for (std::size_t i = 0; i < mesh.size(); ++i)
      finest[mesh.surface_of(mesh.patches[i])] +=
          mesh.patches[i].area_m2 * irradiance(static_cast<Index>(i), 0);
    for (std::size_t s = 0; s < 6; ++s) {
      const auto row = static_cast<Index>(s);
      const double error = std::abs(means.irradiance(row, 0) - certified_mean(s));
      EXPECT_LE(error, means.error_bound(row, 0)) << elements << ' ' << s;
      EXPECT_LT(error, 0.5 * std::abs(finest[s] - certified_mean(s))) << elements << ' ' << s;
      EXPECT_LE(means.error_bound(row, 0), of_finest(row, 0)) << elements << ' ' << s;
      EXPECT_LE(means.bound_in_order(row, 0), means.error_bound(row, 0)) << elements << ' ' << s;
    }
  }
}

// The block's faces have one element each on the coarsest grid: two such agree by chance, which
// must not be taken for a high order. Truth: 4500 elements, whose bound is a fourth of these.
TEST(SurfaceMeans, AreWithinTheirBoundInABlockedRoomWhereGridsAgreeByChance) {
  const Scene scene = blocked_room(0.95);
  const auto means_with = [&](std::size_t elements) {
    PredictOptions options;
    options.elements = elements;
    return Prediction(scene, options).surface_means();
  };
  const SurfaceMeans truth = means_with(4500);
  for (const std::size_t elements : {500u, 1000u, 2000u}) {
    const SurfaceMeans means = means_with(elements);
    for (Index s = 0; s < means.irradiance.rows(); ++s) {
      if (truth.area_m2[s] == 0.0) continue;  // the block's underside
      EXPECT_NEAR(means.irradiance(s, 0), truth.irradiance(s, 0), means.error_bound(s, 0))
          << elements << ' ' << scene.surfaces[static_cast<std::size_t>(s)].name;
      EXPECT_LT(means.error_bound(s, 0), 2e-3 * truth.irradiance(s, 0));
    }
  }
}

TEST(MeanOverAnArea, AgreesWithTheMeanOfItsPoints) {
  Scene scene = lit_cube();
  PredictOptions options;
  options.elements = 1200;
  const Prediction prediction(scene, options);
  // Off the grid's lines, across several elements, in a corner.
  const Polygon areas[] = {
      {{0.13, 0.21, 0.0}, {0.57, 0.21, 0.0}, {0.57, 0.66, 0.0}, {0.13, 0.66, 0.0}},
      {{0.0, 0.0, 0.0}, {0.07, 0.0, 0.0}, {0.07, 0.06, 0.0}, {0.0, 0.06, 0.0}}};
  for (const Polygon& area : areas) {
    const auto mean = prediction.mean_irradiance_over(area);
    ASSERT_TRUE(mean);
    double sum = 0.0, bound = 0.0;
    constexpr int kSide = 8;
    for (int i = 0; i < kSide; ++i)
      for (int j = 0; j < kSide; ++j) {
        const Vec3 x = area[0] + (i + 0.5) / kSide * (area[1] - area[0]) +
                       (j + 0.5) / kSide * (area[3] - area[0]);
        const BoundedIrradiance at = prediction.irradiance_at(x, Vec3::UnitZ());
        sum += at.value[0] / (kSide * kSide);
        bound += at.error_bound[0] / (kSide * kSide);
      }
    // The midpoint rule adds (h^2 / 24) of the curvature, below 4e-4 here.
    EXPECT_NEAR(mean->value[0], sum, mean->error_bound[0] + bound + 4e-4 * sum);
    EXPECT_LT(mean->error_bound[0], 0.02 * sum);
  }
}

TEST(MeanOverAnArea, IsNoneWhereNoLitSideIs) {
  const Scene scene = lit_cube();
  PredictOptions options;
  options.elements = 100;
  const Prediction prediction(scene, options);
  const Polygon floor_from_below = {{0.1, 0.1, 0}, {0.1, 0.2, 0}, {0.2, 0.2, 0}, {0.2, 0.1, 0}};
  const Polygon in_the_air = {{0.1, 0.1, 0.5}, {0.2, 0.1, 0.5}, {0.2, 0.2, 0.5}, {0.1, 0.2, 0.5}};
  EXPECT_FALSE(prediction.mean_irradiance_over(floor_from_below));
  EXPECT_FALSE(prediction.mean_irradiance_over(in_the_air));
}

}  // namespace
}  // namespace truebox

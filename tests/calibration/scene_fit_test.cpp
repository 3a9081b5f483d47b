// SPDX-License-Identifier: BSD-3-Clause
#include "fit/scene_fit.h"

#include <gmock/gmock.h>

#include <cmath>

#include "calibration/scene_fit_cases.h"

namespace truebox {
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr std::array<double, 6> kCornell = {.15, .60, .75, .75, .75, .75};

/// The problem as posed by somebody who does not know the truth: other starting values.
Scene with_reflectance(Scene scene, double rho) {
  for (Material& m : scene.materials) m.reflectance = Reflectance(scene.bands.size(), rho);
  return scene;
}

SceneFitProblem posed_with(const SceneModel& ignorant, SceneFitProblem problem) {
  problem.model = &ignorant;
  return problem;
}

double worst_error(const SceneFit& fit, const Scene& truth) {
  double worst = 0.0;
  for (const FittedSpectrum& s : fit.spectra)
    for (std::size_t b = 0; b < s.reflectance.size(); ++b)
      worst = std::max(
          worst, std::abs(s.reflectance[b].value - truth.materials[s.material].reflectance[b]));
  return worst;
}

TEST(SceneFit, FindsTheTruthWithoutNoise) {
  const Scene truth = lit_cube({kCornell, {.3, .2, .5, .6, .4, .8}});
  const Scene guess = with_reflectance(truth, 0.5);
  SceneModel model(truth, cube_grid(0.25)), ignorant(guess, cube_grid(0.25));
  model.add_elements();
  ignorant.add_elements();
  SceneFitProblem problem = posed_with(ignorant, cube_problem(model, 0.01));
  for (PlaneReadings& plane : problem.planes) {
    plane.gain = Hold::free;
    for (BlockReading& r : plane.readings) r.value *= 37.0;  // and the gain
  }
  const SceneFit fit = fit_scene(problem, {});
  EXPECT_EQ(fit.summary.outcome, Outcome::converged) << fit.full();
  EXPECT_LT(worst_error(fit, truth), 1e-6);
  EXPECT_NEAR(fit.parameters.back().estimate.value, 37.0, 37e-6);
  EXPECT_LT(fit.summary.chi2, 1e-6);
}

TEST(SceneFit, FindsATruthAtEitherEndOfTheRange) {
  const Scene truth = lit_cube({{0.0, 0.999, 0.5, 0.3, 0.999, 0.7}});
  const Scene guess = with_reflectance(truth, 0.5);
  SceneModel model(truth, cube_grid(0.25)), ignorant(guess, cube_grid(0.25));
  model.add_elements();
  ignorant.add_elements();
  SceneFitProblem problem = cube_problem(model, 0.01);
  for (BlockReading& r : problem.planes[0].readings)
    r.standard_uncertainty = std::max(r.standard_uncertainty, 1e-4);
  const SceneFit fit = fit_scene(posed_with(ignorant, problem), {});
  EXPECT_LT(worst_error(fit, truth), 1e-6) << fit.full();
  EXPECT_TRUE(fit.parameters[0].at_bound) << "reflectance 0 is the bound itself";
  EXPECT_EQ(fit.parameters[0].estimate.standard_uncertainty, 0.0);
  EXPECT_THAT(fit.parameters[0].note, HasSubstr("no uncertainty is claimed"));
  EXPECT_FALSE(fit.parameters[1].at_bound);
  EXPECT_GT(fit.parameters[1].estimate.standard_uncertainty, 0.0);
}

TEST(SceneFit, HasExactDerivatives) {
  const Scene scene = lit_cube({kCornell, {.3, .2, .5, .6, .4, .8}});
  SceneModel model(scene, cube_grid(0.25));
  model.add_elements();
  SceneFitProblem problem = cube_problem(model, 0.01);
  problem.emissions[0] = {Hold::free, true, 0.0};
  problem.reflectances[0].basis = SpectralBasis::constant;
  problem.reflectances[1].basis = SpectralBasis::linear;
  problem.reflectances[1].count = 2;
  for (PlaneReadings& plane : problem.planes) {
    plane.gain = Hold::free;
    plane.band_weights = Eigen::Vector2d(0.7, 0.4);
  }
  ResponseChoice response;
  response.segments = 3;
  response.white = 0.2;
  problem.response = response;
  // Central differences of step 1e-4: 1e-8 of curvature; a knot of the response within a step adds
  // its kink, of which the offset steers clear.
  EXPECT_LT(largest_scene_jacobian_error(problem, 0.03), 1e-5);
}

TEST(SceneFit, ReportsADarkRoomWithFreeGainAsHardlyDetermined) {
  const Scene scene = lit_cube({{.05, .05, .05, .05, .05, .05}});
  SceneModel model(scene, cube_grid(0.125));
  model.add_elements();
  SceneFitProblem problem = cube_problem(model, 0.01);
  problem.planes[0].gain = Hold::free;
  const SceneFit fit = fit_scene(problem, {});
  const Eigen::Index gain = fit.correlation.rows() - 1;
  EXPECT_GT(std::abs(fit.correlation(0, gain)), 0.99);
  EXPECT_THAT(fit.parameters.back().note, HasSubstr("hardly told apart"));
  EXPECT_THAT(fit.weakest_direction, HasSubstr("against gain of band 1"));
}

TEST(SceneFit, RefusesEmissionAndGainBothFree) {
  const Scene scene = lit_cube({kCornell});
  SceneModel model(scene, cube_grid(0.25));
  model.add_elements();
  SceneFitProblem problem = cube_problem(model, 0.01);
  problem.planes[0].gain = Hold::free;
  problem.emissions[0].hold = Hold::free;
  const SceneFit fit = fit_scene(problem, {});
  EXPECT_EQ(fit.summary.outcome, Outcome::rank_deficient);
  ASSERT_EQ(fit.null_directions.size(), 1u);
  EXPECT_THAT(fit.null_directions[0], HasSubstr("emission scale"));
  EXPECT_THAT(fit.null_directions[0], HasSubstr("gain of band 1"));
  for (const FittedParameter& p : fit.parameters)
    EXPECT_EQ(p.determined, p.kind == "reflectances") << p.name;

  problem.emissions[0] = {Hold::prior, false, 0.02};
  const SceneFit tied = fit_scene(problem, {});
  EXPECT_EQ(tied.summary.outcome, Outcome::converged) << tied.full();
}

TEST(SceneFit, NamesAllReflectancesWhereOnlyDirectLightIsModelled) {
  const Scene scene = lit_cube({kCornell});
  SceneModel model(scene, cube_grid(0.25));
  model.add_elements();
  SceneFitProblem problem = cube_problem(model, 0.01);
  problem.interreflection = false;
  const std::vector<double> direct = predicted_readings(problem);
  for (std::size_t i = 0; i < direct.size(); ++i) problem.planes[0].readings[i].value = direct[i];
  // Without interreflection the ceiling gets no light and the others trade against the emission.
  problem.reflectances[5].hold = Hold::fixed;
  problem.reflectances[6] = {};
  problem.emissions[0].hold = Hold::free;
  std::erase_if(problem.planes[0].readings,
                [&](const BlockReading& r) { return model.blocks()[r.block].surface > 4; });
  const SceneFit fit = fit_scene(problem, {});
  EXPECT_EQ(fit.summary.outcome, Outcome::rank_deficient);
  EXPECT_EQ(fit.summary.null_direction, "all reflectances against emission scale");
}

TEST(SceneFit, SaysThatASurfaceIsKnownThroughInterreflectionOnly) {
  const Scene scene = lit_cube({kCornell});
  SceneModel model(scene, cube_grid(0.25));
  model.add_elements();
  SceneFitProblem problem = cube_problem(model, 0.01);
  const SceneFit seen = fit_scene(problem, {});
  std::erase_if(problem.planes[0].readings,
                [&](const BlockReading& r) { return model.blocks()[r.block].surface == 1; });
  const SceneFit fit = fit_scene(problem, {});
  EXPECT_EQ(fit.summary.outcome, Outcome::converged);
  EXPECT_THAT(fit.parameters[1].note, HasSubstr("known through interreflection only"));
  EXPECT_GT(fit.parameters[1].estimate.standard_uncertainty,
            3.0 * seen.parameters[1].estimate.standard_uncertainty);
  EXPECT_THAT(seen.parameters[1].note, Not(HasSubstr("interreflection")));

  problem.interreflection = false;
  const SceneFit direct = fit_scene(problem, {});
  EXPECT_EQ(direct.summary.outcome, Outcome::rank_deficient);
  EXPECT_FALSE(direct.parameters[1].determined);
  EXPECT_THAT(direct.parameters[1].note, HasSubstr("seen by no pixel"));
  EXPECT_TRUE(direct.parameters[1].at_initial_value);
}

TEST(SceneFit, FitsOneReading) {
  const Scene scene = lit_cube({kCornell});
  SceneModel model(scene, cube_grid(0.25));
  model.add_elements();
  SceneFitProblem problem = cube_problem(model, 0.01);
  problem.reflectances.assign(7, ReflectanceChoice{});
  problem.reflectances[4].hold = Hold::free;
  std::erase_if(problem.planes[0].readings,
                [&](const BlockReading& r) { return model.blocks()[r.block].surface != 4; });
  problem.planes[0].readings.resize(1);
  const SceneFit fit = fit_scene(problem, {});
  EXPECT_EQ(fit.summary.outcome, Outcome::converged) << fit.full();
  EXPECT_NEAR(fit.parameters[0].estimate.value, 0.75, 1e-6);
}

TEST(SceneFit, RefusesNoReadingsNoLightAndBadNumbers) {
  const Scene scene = lit_cube({kCornell}), dark = lit_cube({kCornell}, 0.0);
  SceneModel model(scene, cube_grid(0.5)), unlit(dark, cube_grid(0.5));
  model.add_elements();
  unlit.add_elements();
  SceneFitProblem problem = cube_problem(model, 0.01);
  SceneFitProblem none = problem, nan = problem, no_light = posed_with(unlit, problem);
  none.planes[0].readings.clear();
  nan.planes[0].readings[3].value = std::nan("");
  no_light.emissions.clear();
  EXPECT_THAT(fit_scene(none, {}).summary.message, HasSubstr("no pixel can be used"));
  EXPECT_THAT(fit_scene(nan, {}).summary.message, HasSubstr("finite"));
  EXPECT_THAT(fit_scene(no_light, {}).summary.message, HasSubstr("nothing in the scene emits"));
  EXPECT_EQ(fit_scene(none, {}).summary.outcome, Outcome::invalid_problem);
}

TEST(SceneFit, KeepsTheBestSoFarWhenStopped) {
  const Scene truth = lit_cube({kCornell}), guess = with_reflectance(truth, 0.2);
  SceneModel model(truth, cube_grid(0.25)), ignorant(guess, cube_grid(0.25));
  model.add_elements();
  ignorant.add_elements();
  SceneFitOptions options;
  options.on_step = [](const FitStep& step) { return step.iteration >= 2; };
  const SceneFit fit = fit_scene(posed_with(ignorant, cube_problem(model, 0.01)), options);
  EXPECT_TRUE(fit.stopped);
  EXPECT_EQ(fit.summary.outcome, Outcome::not_converged);
  ASSERT_EQ(fit.history.size(), 3u);
  EXPECT_LT(fit.history[2].chi2, fit.history[0].chi2);
  EXPECT_NEAR(fit.log_likelihood_chi2, fit.history[2].chi2, 1e-6 * fit.history[2].chi2);
}

TEST(SceneFit, GivesOutliersLessWeight) {
  const Scene scene = lit_cube({kCornell});
  SceneModel model(scene, cube_grid(0.25));
  model.add_elements();
  SceneFitProblem problem = cube_problem(model, 0.01);
  for (std::size_t i = 0; i < problem.planes[0].readings.size(); i += 12)
    problem.planes[0].readings[i].value *= 1.5;
  SceneFitOptions robust;
  robust.robust_sigma = 2.5;
  const SceneFit fit = fit_scene(problem, robust), plain = fit_scene(problem, {});
  EXPECT_LT(worst_error(fit, scene), 0.3 * worst_error(plain, scene));
  EXPECT_EQ(fit.outliers, (problem.planes[0].readings.size() + 11) / 12);
}

TEST(SceneFit, CountsWhatASurfaceSharesOnce) {
  const Scene scene = lit_cube({kCornell});
  SceneModel model(scene, cube_grid(0.125));
  model.add_elements();
  SceneFitProblem problem = cube_problem(model, 0.01);
  const SceneFit alone = fit_scene(problem, {});
  problem.region_relative_u = BandMatrix::Constant(10, 1, 0.02);
  const SceneFit joint = fit_scene(problem, {});
  // 2 % that a face shares cannot average away; its light on the others tells a little more.
  const double u = joint.parameters[0].estimate.standard_uncertainty;
  EXPECT_GT(u, 0.75 * 0.02 * 0.15);
  EXPECT_GT(u, 10.0 * alone.parameters[0].estimate.standard_uncertainty);
  EXPECT_NEAR(joint.parameters[0].budget.combined(), u, 1e-9);
  EXPECT_GT(joint.parameters[0].budget.of("common to a surface (model error)"), 0.8 * u);
  EXPECT_LT(joint.effective_readings, 60.0);
  EXPECT_EQ(alone.effective_readings, 380.0);
}

TEST(SceneFit, AddsUpItsBudgets) {
  const Scene scene = lit_cube({kCornell});
  SceneModel model(scene, cube_grid(0.25));
  model.add_elements();
  SceneFitProblem problem = cube_problem(model, 0.01);
  problem.planes[0].gain = Hold::prior;
  problem.planes[0].gain_relative_u = 0.02;
  const SceneFit fit = fit_scene(problem, {});
  for (const FittedParameter& p : fit.parameters) {
    EXPECT_NEAR(p.budget.combined(), p.estimate.standard_uncertainty,
                1e-6 * p.estimate.standard_uncertainty);
    EXPECT_GT(p.budget.of("exposure"), 0.0) << p.name;
  }
}

TEST(SceneFit, ConstrainsSpectraByThreeChannelsAndAPrior) {
  // Nine bands seen through three wide channels. What tells bands apart without a prior is only
  // that a brighter band is spread more evenly by interreflection: next to nothing.
  std::vector<std::array<double, 6>> albedos;
  for (int b = 0; b < 9; ++b) {
    std::array<double, 6> rho{};
    for (int f = 0; f < 6; ++f) rho[static_cast<std::size_t>(f)] = 0.2 + 0.05 * b + 0.03 * f;
    albedos.push_back(rho);
  }
  const Scene truth = lit_cube(albedos), guess = with_reflectance(truth, 0.5);
  SceneModel model(truth, cube_grid(0.25)), ignorant(guess, cube_grid(0.25));
  model.add_elements();
  ignorant.add_elements();
  SceneFitProblem problem = cube_problem(model, 0.01);
  problem.planes.resize(3);
  for (int k = 0; k < 3; ++k) {
    Eigen::VectorXd w = Eigen::VectorXd::Zero(9);
    for (int b = 0; b < 9; ++b) w[b] = std::exp(-0.5 * std::pow((b - 1.0 - 3.0 * k) / 1.5, 2));
    problem.planes[static_cast<std::size_t>(k)].band_weights = w;
  }
  const std::vector<double> exact = predicted_readings(problem);
  std::size_t row = 0;
  for (PlaneReadings& plane : problem.planes)
    for (BlockReading& r : plane.readings) {
      r.value = exact[row++];
      r.standard_uncertainty = 0.001 * r.value;
    }
  problem = posed_with(ignorant, problem);
  const SceneFit without = fit_scene(problem, {});
  for (std::size_t f = 0; f < 6; ++f) problem.reflectances[f].curvature_u = 0.002;
  const SceneFit with = fit_scene(problem, {});
  EXPECT_EQ(with.summary.outcome, Outcome::converged) << with.full();
  // Straight spectra have no curvature: the prior is true here, and three channels fix the rest.
  EXPECT_LT(worst_error(with, truth), 0.02);
  const auto largest_u = [](const SceneFit& fit) {
    double u = 0.0;
    for (const FittedParameter& p : fit.parameters)
      u = std::max(u, p.estimate.standard_uncertainty);
    return u;
  };
  EXPECT_GT(largest_u(without), 10.0 * largest_u(with));
  for (const FittedSpectrum& s : with.spectra)
    for (std::size_t b = 0; b < 9; ++b)
      EXPECT_LT(std::abs(s.reflectance[b].value - truth.materials[s.material].reflectance[b]),
                3.0 * s.reflectance[b].standard_uncertainty + 1e-6);
}

}  // namespace
}  // namespace truebox

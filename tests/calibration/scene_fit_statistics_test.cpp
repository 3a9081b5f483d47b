// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "calibration/scene_fit_cases.h"
#include "radiometry/table_file.h"
#include "uncertainty/coverage.h"

namespace truebox {
namespace {

std::array<double, 6> albedos_of(const std::string& scene) {
  if (scene.starts_with("cornell")) return {.15, .60, .75, .75, .75, .75};
  const double rho = scene.starts_with("dark") ? .05 : scene.starts_with("mid") ? .5 : .9;
  return {rho, rho, rho, rho, rho, rho};
}

TEST(SceneFitUncertainty, IsTheCramerRaoBoundInEveryRow) {
  const TableFile table =
      read_table(std::string(TRUEBOX_REFERENCE_DIR) + "/analytic/albedo_crlb.csv");
  ASSERT_EQ(table.rows.size(), 12u);
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    const std::string& scene_name = table.rows[row][0];
    const std::string& mode = table.rows[row][1];
    const Scene scene = lit_cube({albedos_of(scene_name)});
    SceneModel model(scene, cube_grid(0.125));
    model.add_elements();
    ASSERT_EQ(model.blocks().size(), 380u);
    SceneFitProblem problem = cube_problem(model, 0.01);
    if (mode == "gain free") problem.planes[0].gain = Hold::free;
    if (mode == "gain prior 2%") {
      problem.planes[0].gain = Hold::prior;
      problem.planes[0].gain_relative_u = 0.02;
    }
    const SceneFit fit = fit_scene(problem, {});
    ASSERT_EQ(fit.summary.outcome, Outcome::converged) << scene_name << ", " << mode;
    for (std::size_t k = 0; k < fit.parameters.size(); ++k) {
      const double bound = table.number(row, 2 + k);
      // What the issue asks for; form factors good to 1e-5 leave far less.
      EXPECT_NEAR(fit.parameters[k].estimate.standard_uncertainty, bound, 0.05 * bound)
          << scene_name << ", " << mode << ", " << fit.parameters[k].name;
    }
  }
}

/// How often the 95 % interval of each parameter holds the truth over simulated fits.
std::vector<double> covered(const Scene& scene, SceneFitProblem exact, int fits) {
  std::mt19937 random(20261123);
  std::normal_distribution<double> normal;
  const SceneFit best = fit_scene(exact, {});
  std::vector<double> held(best.parameters.size(), 0.0);
  for (int n = 0; n < fits; ++n) {
    SceneFitProblem problem = exact;
    add_noise(problem, random);
    for (PlaneReadings& plane : problem.planes)
      if (plane.gain == Hold::prior)  // what is known of the exposure errs by its own u
        plane.gain_value *= 1.0 + plane.gain_relative_u * normal(random);
    const SceneFit fit = fit_scene(problem, {});
    EXPECT_EQ(fit.summary.outcome, Outcome::converged);
    for (std::size_t k = 0; k < held.size(); ++k)
      held[k] += std::abs(fit.parameters[k].estimate.value - best.parameters[k].estimate.value) <=
                 1.96 * fit.parameters[k].estimate.standard_uncertainty;
  }
  (void)scene;
  for (double& h : held) h /= fits;
  return held;
}

TEST(SceneFitUncertainty, CoversTheTruthAtItsStatedConfidence) {
  const Scene scene = lit_cube({{.15, .60, .75, .70, .65, .75}});
  SceneModel model(scene, cube_grid(0.25));
  model.add_elements();
  SceneFitProblem problem = cube_problem(model, 0.01);
  problem.planes[0].gain = Hold::free;
  // 500 fits leave a standard error of 1 % about 95 %.
  for (const double share : covered(scene, problem, 500)) {
    EXPECT_GE(share, 0.93);
    EXPECT_LE(share, 0.97);
  }
}

TEST(SceneFitUncertainty, CoversTheTruthWithAnExposureKnownToTwoPercent) {
  const Scene scene = lit_cube({{.15, .60, .75, .70, .65, .75}});
  SceneModel model(scene, cube_grid(0.25));
  model.add_elements();
  SceneFitProblem problem = cube_problem(model, 0.01);
  problem.planes[0].gain = Hold::prior;
  problem.planes[0].gain_relative_u = 0.02;
  for (const double share : covered(scene, problem, 500)) {
    EXPECT_GE(share, 0.93);
    EXPECT_LE(share, 0.97);
  }
}

}  // namespace
}  // namespace truebox

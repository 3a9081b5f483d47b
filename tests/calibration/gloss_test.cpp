// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "calibration/shaped_scene_cases.h"
#include "fit/gloss_lobe.h"
#include "fit/scene_select.h"
#include "path_tracer/path_tracer.h"
#include "sensor/camera.h"
#include "uncertainty/distributions.h"

namespace truebox {
namespace {

constexpr double kRoughness = 0.3;

/// The room, seen by the camera, with a lobe for the floor and for the back wall.
ShapedScene glossy_room(const Scene& scene, double roughness = kRoughness) {
  ShapedScene shaped = shaped_scene(scene, {}, 0.17, 0);
  SceneModelOptions options = shaped.model->options();
  options.roughness = {roughness, 0, roughness, 0, 0, 0};
  shaped.model = std::make_unique<SceneModel>(*shaped.scene, options);
  shaped.model->add_view(scene.cameras.at("front"));
  return shaped;
}

TEST(GlossLobe, SendsNoMoreThanItReceives) {
  // Integral of f cos over incoming directions: the weak furnace test of Smith's shadowing is
  // below 1 and falls with the roughness, since light after a second facet is lost.
  for (const double alpha : {0.1, 0.3, 0.6}) {
    const GlossLobe lobe(alpha);
    for (const double tilt : {0.0, 0.8, 1.3}) {
      const Vec3 out(std::sin(tilt), 0.0, std::cos(tilt));
      double sum = 0.0;
      constexpr int kSteps = 400;
      for (int i = 0; i < kSteps; ++i)
        for (int j = 0; j < kSteps; ++j) {
          const double z = (i + 0.5) / kSteps, phi = 2.0 * std::numbers::pi * (j + 0.5) / kSteps;
          const double r = std::sqrt(1.0 - z * z);
          sum += z * lobe.value(Vec3::UnitZ(), out, {r * std::cos(phi), r * std::sin(phi), z});
        }
      sum *= 2.0 * std::numbers::pi / (kSteps * kSteps);
      EXPECT_LT(sum, 1.0 + 1e-3) << alpha << " " << tilt;
      EXPECT_GT(sum, alpha < 0.2 ? 0.85 : 0.5) << alpha << " " << tilt;
    }
  }
}

TEST(GlossLobe, IsTheRoughConductorOfThePathTracerUnderALamp) {
  // A floor that is nothing but facets of reflectance 1 (n = 0, k large), black walls: what the
  // camera sees is the lamp in the lobe, to all orders. The path tracer shares no code with it.
  Scene scene = room_with_block();
  scene.surfaces.erase(scene.surfaces.begin() + 4, scene.surfaces.end() - 1);
  for (Material& m : scene.materials) m.reflectance[0] = 0.0;
  const ShapedScene shaped = glossy_room(scene);
  SceneState state = shaped.model->state();
  state.gloss[0] = 1.0;
  const BandMatrix seen = shaped.model->radiosity(state, nullptr).value;

  Scene mirror = scene;
  mirror.materials[0].scattering = Scattering::rough_conductor;
  mirror.materials[0].refractive_index = RefractiveIndex(1, 1e-3);
  mirror.materials[0].absorption_index = RefractiveIndex(1, 1e3);
  mirror.materials[0].roughness = kRoughness;
  const Camera camera(scene.cameras.at("front"));
  PathTraceOptions options;
  options.samples = 64;
  const PathTracedImage traced = trace_paths(
      mirror, 64, 64,
      [&](int x, int y, UnitPair position) -> std::optional<PixelRay> {
        const auto ray = camera.ray({x + position.u, y + position.v});
        if (!ray) return std::nullopt;
        return PixelRay{ray->origin_m, ray->direction};
      },
      options);
  double chi2 = 0.0, n = 0.0;
  for (std::size_t i = 0; i < shaped.model->blocks().size(); ++i) {
    const ViewBlock& block = shaped.model->blocks()[i];
    if (block.surface != 0) continue;
    double mean = 0.0, variance = 0.0;
    for (const std::uint32_t p : block.pixels) {
      mean += traced.radiance.channels[0].samples[p];
      variance += traced.variance.channels[0].samples[p];
    }
    const double count = static_cast<double>(block.pixels.size());
    mean *= std::numbers::pi / count;
    const double model = seen(static_cast<Eigen::Index>(i), 0);
    // Sixteen points and a plane stand for the block: 1 % of what it sends.
    const double u = std::hypot(std::numbers::pi * std::sqrt(variance) / count, 0.01 * model);
    EXPECT_NEAR(mean, model, 0.05 * model + 5.0 * u) << "element " << block.element;
    chi2 += std::pow((mean - model) / u, 2);
    n += 1.0;
  }
  ASSERT_GT(n, 10.0);
  EXPECT_GT(chi_squared_upper_tail(chi2, n), 1e-4) << chi2 << " of " << n;
}

SceneFitProblem glossy_problem(const ShapedScene& shaped, double floor, double back,
                               double relative_u) {
  SceneFitProblem problem = room_problem(shaped, relative_u);
  problem.planes[0].gain = Hold::fixed;
  problem.gloss.assign(6, GlossChoice{});
  problem.gloss[0].value = floor;
  problem.gloss[2].value = back;
  const std::vector<double> exact = predicted_readings(problem);
  for (std::size_t i = 0; i < exact.size(); ++i) {
    problem.planes[0].readings[i].value = exact[i];
    problem.planes[0].readings[i].standard_uncertainty = relative_u * exact[i];
  }
  problem.planes[0].gain = Hold::free;
  for (GlossChoice& g : problem.gloss) g.value = 0.0;
  problem.gloss[0].hold = problem.gloss[2].hold = Hold::free;
  return problem;
}

TEST(GlossFit, FindsTheStrengthWithoutNoiseAndHasExactDerivatives) {
  const ShapedScene shaped = glossy_room(room_with_block());
  const SceneFitProblem problem = glossy_problem(shaped, 0.05, 0.02, 0.01);
  EXPECT_LT(largest_scene_jacobian_error(problem, 0.03), 1e-5);
  const SceneFit fit = fit_scene(problem, {});
  ASSERT_EQ(fit.summary.outcome, Outcome::converged) << fit.full();
  EXPECT_NEAR(fit.parameters[6].estimate.value, 0.05, 1e-6) << fit.full();
  EXPECT_NEAR(fit.parameters[7].estimate.value, 0.02, 1e-6);
  EXPECT_GT(fit.gloss_left_out, 0.0);
  EXPECT_LT(fit.gloss_left_out, 0.05);
}

TEST(GlossFit, SaysThatNoGlossIsSeenWhereThereIsNone) {
  const ShapedScene shaped = glossy_room(room_with_block());
  SceneFitProblem problem = glossy_problem(shaped, 0.0, 0.0, 0.01);
  const SceneFit fit = fit_scene(problem, {});
  ASSERT_EQ(fit.summary.outcome, Outcome::converged) << fit.full();
  EXPECT_TRUE(fit.parameters[6].at_bound) << fit.full();
  EXPECT_THAT(fit.parameters[6].note, testing::HasSubstr("no gloss is seen"));
}

TEST(GlossFit, CoversTheTruthAtItsStatedConfidence) {
  const ShapedScene shaped = glossy_room(room_with_block());
  const SceneFitProblem exact = glossy_problem(shaped, 0.08, 0.08, 0.01);
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  const SceneFit best = fit_scene(exact, {});
  std::vector<double> held(best.parameters.size(), 0.0);
  constexpr int kFits = 500;
  for (int n = 0; n < kFits; ++n) {
    SceneFitProblem problem = exact;
    for (BlockReading& r : problem.planes[0].readings)
      r.value += r.standard_uncertainty * normal(random);
    const SceneFit fit = fit_scene(problem, {});
    for (std::size_t k = 0; k < held.size(); ++k)
      held[k] += std::abs(fit.parameters[k].estimate.value - best.parameters[k].estimate.value) <=
                 1.96 * fit.parameters[k].estimate.standard_uncertainty;
  }
  for (std::size_t k = 0; k < held.size(); ++k) {
    EXPECT_GE(held[k] / kFits, 0.93) << best.parameters[k].name;
    EXPECT_LE(held[k] / kFits, 0.97) << best.parameters[k].name;
  }
}

/// Readings with 1 % of noise, every fifth held out; which model is chosen.
std::string chosen(double gloss) {
  const ShapedScene shaped = glossy_room(room_with_block());
  SceneFitProblem problem = glossy_problem(shaped, gloss, gloss, 0.01);
  problem.gloss.clear();
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  std::vector<BlockReading> fitted, held_out;
  for (BlockReading r : problem.planes[0].readings) {
    r.value += r.standard_uncertainty * normal(random);
    (fitted.size() + held_out.size() + 1) % 5 == 0 ? held_out.push_back(r) : fitted.push_back(r);
  }
  problem.planes[0].readings = fitted;
  const auto candidates = select_model(problem, {held_out}, {});
  EXPECT_EQ(candidates.size(), 4u);
  for (const ModelCandidate& c : candidates)
    if (c.chosen) return c.name;
  return describe(candidates);
}

TEST(ModelSelection, ChoosesGlossWhereItIsThereAndOnlyThere) {
  EXPECT_EQ(chosen(0.0), "interreflection");
  EXPECT_EQ(chosen(0.08), "interreflection and gloss");
}

}  // namespace
}  // namespace truebox

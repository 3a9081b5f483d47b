// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <Eigen/Dense>
#include <cmath>

#include "calibration/shaped_scene_cases.h"

namespace truebox {
namespace {

using testing::HasSubstr;

std::vector<ShapeUnknown> pose_of(const Scene& scene) {
  std::vector<ShapeUnknown> unknowns;
  for (const CameraTerm term : {CameraTerm::tilt, CameraTerm::pan, CameraTerm::roll,
                                CameraTerm::right, CameraTerm::down, CameraTerm::forward})
    unknowns.push_back(camera_unknown(scene, "front", term));
  return unknowns;
}

std::vector<ShapeUnknown> all_of(const Scene& scene) {
  std::vector<ShapeUnknown> unknowns = pose_of(scene);
  for (const CameraTerm term :
       {CameraTerm::focal_length, CameraTerm::principal_point_x, CameraTerm::principal_point_y,
        CameraTerm::k1, CameraTerm::k2, CameraTerm::p1, CameraTerm::p2, CameraTerm::k3})
    unknowns.push_back(camera_unknown(scene, "front", term));
  unknowns.push_back(block_offset("block, x", Vec3::UnitX(), Vec3::Zero()));
  unknowns.push_back(block_offset("block height", Vec3::Zero(), Vec3::UnitZ()));
  return unknowns;
}

/// What the fit starts from is off by so many pixels of each unknown, alternating in sign.
std::vector<double> displaced(const ShapedScene& shaped, double px) {
  std::vector<double> at = shaped.values;
  for (std::size_t k = 0; k < at.size(); ++k)
    at[k] += (k % 2 ? -1.0 : 1.0) * px * shaped.size_of(k) *
             (shaped.unknowns[k].moves_surfaces() ? 0.5 : 1.0);
  return at;
}

/// Readings of the scene at `truth`, in the windows of the scene where it is now.
SceneFitProblem seen_from(ShapedScene& shaped, const std::vector<double>& truth,
                          double relative_u) {
  const std::vector<double> start = shaped.values;
  shaped.move_to(truth);
  SceneFitProblem problem = room_problem(shaped, relative_u);
  shaped.move_to(start);
  problem.model = shaped.model.get();
  return problem;
}

double worst_in_sizes(const ShapedScene& shaped, const std::vector<double>& truth) {
  double worst = 0.0;
  for (std::size_t k = 0; k < truth.size(); ++k)
    worst = std::max(worst, std::abs(shaped.values[k] - truth[k]) / shaped.size_of(k));
  return worst;
}

TEST(ShapedScene, FindsPoseAndFocalLengthWithoutNoise) {
  const Scene scene = room_with_block();
  auto unknowns = pose_of(scene);
  unknowns.push_back(camera_unknown(scene, "front", CameraTerm::focal_length));
  unknowns.push_back(camera_unknown(scene, "front", CameraTerm::k1));
  ShapedScene shaped = shaped_scene(scene, unknowns, 0.34);
  const std::vector<double> truth = displaced(shaped, 0.4);
  SceneFitProblem problem = seen_from(shaped, truth, 0.01);
  ShapeFitOptions options;
  options.tolerance = 1e-5;
  const SceneFit fit = fit_shaped_scene(problem, shaped, options);
  ASSERT_EQ(fit.summary.outcome, Outcome::converged) << fit.full();
  EXPECT_LT(worst_in_sizes(shaped, truth), 1e-6) << "of what moves the picture by 1 px";
  EXPECT_NEAR(fit.parameters[0].estimate.value, 0.6, 1e-6);
}

TEST(ShapedScene, FindsWhereABlockStandsAndHowHighItIsWithoutNoise) {
  const Scene scene = room_with_block();
  ShapedScene shaped = shaped_scene(scene,
                                    {block_offset("block, x", Vec3::UnitX(), Vec3::Zero()),
                                     block_offset("block height", Vec3::Zero(), Vec3::UnitZ())},
                                    0.34);
  const std::vector<double> truth = {4.0, -0.015};  // mm, 1
  SceneFitProblem problem = seen_from(shaped, truth, 0.01);
  const SceneFit fit = fit_shaped_scene(problem, shaped, {});
  ASSERT_EQ(fit.summary.outcome, Outcome::converged) << fit.full();
  // To 1e-6 m: form factors are found anew wherever the block goes, each to 1e-5.
  EXPECT_NEAR(shaped.values[0], truth[0], 1e-3);
  EXPECT_NEAR(0.32 * shaped.values[1], 0.32 * truth[1], 1e-6);
  EXPECT_NEAR(fit.parameters[0].estimate.value, 0.6, 1e-6);
}

/// d readings / d value by central differences of the whole prediction, other steps than the fit's.
Eigen::VectorXd numeric_column(ShapedScene& shaped, const SceneFitProblem& problem, std::size_t k,
                               double step) {
  const std::vector<double> here = shaped.values;
  Eigen::VectorXd column = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(problem.readings()));
  for (const double sign : {1.0, -1.0}) {
    std::vector<double> at = here;
    at[k] += sign * step;
    shaped.move_to(at);
    SceneFitProblem other = problem;
    other.model = shaped.model.get();
    other.shape.clear();
    const std::vector<double> y = predicted_readings(other);
    for (std::size_t i = 0; i < y.size(); ++i)
      column[static_cast<Eigen::Index>(i)] += sign * y[i] / (2.0 * step);
  }
  shaped.move_to(here);
  return column;
}

TEST(ShapedScene, HasTheDerivativesAndTheUncertaintiesOfAnIndependentCramerRaoBound) {
  const Scene scene = room_with_block();
  ShapedScene shaped = shaped_scene(scene, all_of(scene), 0.34);
  // What no picture of 64 px tells apart is held by priors.
  for (ShapeUnknown& u : shaped.unknowns)
    if (u.name.kind == "lens coefficients") {
      u.hold = Hold::prior;
      u.standard_uncertainty =
          3.0 * shaped.size_of(static_cast<std::size_t>(&u - shaped.unknowns.data()));
    }
  SceneFitProblem problem = room_problem(shaped, 0.01);
  problem.shape = shaped.linearised(shaped.model->state());
  const SceneFit fit = fit_scene(problem, {});
  ASSERT_EQ(fit.summary.outcome, Outcome::converged) << fit.full();

  const auto n = static_cast<Eigen::Index>(problem.readings());
  const auto p = static_cast<Eigen::Index>(fit.parameters.size());
  const Eigen::Index first = p - static_cast<Eigen::Index>(shaped.unknowns.size());
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(n, p);
  const auto value = [&](const SceneFitProblem& at) {
    const std::vector<double> y = predicted_readings(at);
    return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(y.data(), n));
  };
  for (Eigen::Index m = 0; m < 5; ++m) {  // reflectances: other scenes, solved anew
    Eigen::VectorXd difference = Eigen::VectorXd::Zero(n);
    for (const double sign : {1.0, -1.0}) {
      Scene other = scene;
      other.materials[static_cast<std::size_t>(m)].reflectance[0] += sign * 1e-4;
      ShapedScene moved = shaped_scene(other, all_of(other), 0.34);
      SceneFitProblem there = problem;
      there.model = moved.model.get();
      there.shape.clear();
      difference += sign * value(there) / 2e-4;
    }
    jacobian.col(m) = difference;
  }
  SceneFitProblem plain = problem;
  plain.shape.clear();
  jacobian.col(5) = value(plain);  // the gain is 1
  for (std::size_t k = 0; k < shaped.unknowns.size(); ++k) {
    const double step = shaped.size_of(k) * (shaped.unknowns[k].moves_surfaces() ? 0.02 : 0.05);
    jacobian.col(first + static_cast<Eigen::Index>(k)) = numeric_column(shaped, problem, k, step);
  }
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(p, p);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double u = problem.planes[0].readings[static_cast<std::size_t>(i)].standard_uncertainty;
    information += jacobian.row(i).transpose() * jacobian.row(i) / (u * u);
  }
  for (std::size_t k = 0; k < shaped.unknowns.size(); ++k)
    if (shaped.unknowns[k].hold == Hold::prior)
      information(first + static_cast<Eigen::Index>(k), first + static_cast<Eigen::Index>(k)) +=
          std::pow(shaped.unknowns[k].standard_uncertainty, -2);
  const Eigen::VectorXd scale = information.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * information * scale.asDiagonal();
  const Eigen::MatrixXd inverse = scaled.inverse();
  for (Eigen::Index k = 0; k < p; ++k) {
    const double bound = scale[k] * std::sqrt(inverse(k, k));
    const FittedParameter& parameter = fit.parameters[static_cast<std::size_t>(k)];
    EXPECT_NEAR(parameter.estimate.standard_uncertainty, bound, 0.05 * bound) << parameter.name;
  }
}

TEST(ShapedScene, CoversTheTruthOfEveryUnknownAtItsStatedConfidence) {
  const Scene scene = room_with_block();
  ShapedScene shaped = shaped_scene(scene, all_of(scene), 0.34);
  for (std::size_t k = 0; k < shaped.unknowns.size(); ++k)
    if (shaped.unknowns[k].name.kind == "lens coefficients") {
      shaped.unknowns[k].hold = Hold::prior;
      shaped.unknowns[k].standard_uncertainty = 2.0 * shaped.size_of(k);
    }
  SceneFitProblem exact = room_problem(shaped, 0.01);
  exact.shape = shaped.linearised(shaped.model->state());
  std::mt19937 random(20261128);
  std::normal_distribution<double> normal;
  std::vector<double> truth, held;
  for (const FittedParameter& p : fit_scene(exact, {}).parameters)
    truth.push_back(p.estimate.value);
  held.assign(truth.size(), 0.0);
  constexpr int kFits = 1000;  // 0.7 % about 95 %, for 22 numbers
  std::vector<std::string> names;
  for (int n = 0; n < kFits; ++n) {
    SceneFitProblem problem = exact;
    for (BlockReading& r : problem.planes[0].readings)
      r.value += r.standard_uncertainty * normal(random);
    for (ShapeTerm& term : problem.shape)
      if (term.hold == Hold::prior) term.known += term.standard_uncertainty * normal(random);
    const SceneFit fit = fit_scene(problem, {});
    EXPECT_EQ(fit.summary.outcome, Outcome::converged) << fit.full();
    names.clear();
    for (std::size_t k = 0; k < held.size(); ++k) {
      names.push_back(fit.parameters[k].name);
      held[k] += std::abs(fit.parameters[k].estimate.value - truth[k]) <=
                 1.96 * fit.parameters[k].estimate.standard_uncertainty;
    }
  }
  for (std::size_t k = 0; k < held.size(); ++k) {
    EXPECT_GE(held[k] / kFits, 0.93) << names[k];
    EXPECT_LE(held[k] / kFits, 0.97) << names[k];
  }
}

/// A wall of four colours parallel to the film, lit from behind the camera.
Scene flat_scene() {
  Scene scene = room_with_block();
  scene.surfaces.clear();
  for (int k = 0; k < 4; ++k) {
    const double x = k % 2, z = k / 2;
    tiny::add_surface(scene, "quarter " + std::to_string(k),
                      {{x - 1, 1, z - 1}, {x, 1, z - 1}, {x, 1, z}, {x - 1, 1, z}},
                      static_cast<std::size_t>(k));
  }
  tiny::add_surface(scene, "lamp", {{-1, -2, 1}, {-1, -2, 2}, {1, -2, 2}, {1, -2, 1}}, 5);
  CameraDescription& camera = scene.cameras["front"];
  camera.position_m = {0.1, -1.0, 0.05};
  camera.direction = Vec3::UnitY();
  return scene;
}

TEST(ShapedScene, NamesFocalLengthAgainstDistanceBeforeAFlatWall) {
  const Scene scene = flat_scene();
  ShapedScene shaped = shaped_scene(scene,
                                    {camera_unknown(scene, "front", CameraTerm::forward),
                                     camera_unknown(scene, "front", CameraTerm::focal_length)},
                                    0.5);
  SceneFitProblem problem = room_problem(shaped, 0.01);
  problem.reflectances[4] = {};
  problem.planes[0].gain = Hold::fixed;  // nothing sends light back: rho would trade against it
  SceneFit fit = fit_shaped_scene(problem, shaped, {});
  EXPECT_EQ(fit.summary.outcome, Outcome::rank_deficient) << fit.full();
  EXPECT_THAT(fit.summary.null_direction, HasSubstr("focal length of camera front"));
  EXPECT_THAT(fit.summary.null_direction, HasSubstr("position of camera front (forward)"));
  for (const FittedParameter& p : fit.parameters)
    EXPECT_EQ(p.determined, p.kind != "poses" && p.kind != "lens coefficients") << p.name;

  shaped.unknowns[1].hold = Hold::prior;
  shaped.unknowns[1].standard_uncertainty = 0.1;
  fit = fit_shaped_scene(problem, shaped, {});
  EXPECT_EQ(fit.summary.outcome, Outcome::converged) << fit.full();
}

TEST(MixedWindows, HaveTheSharesOfAStraightEdge) {
  // The flat wall's colours meet in x = 0 and z = 0: shares are areas of a square cut by lines.
  const Scene scene = flat_scene();
  ShapedScene shaped = shaped_scene(scene, {}, 0.5);
  const double px_per_m = 64.0 * 0.035 / 0.036 / 2.0;
  const double edge_x = 32.0 - px_per_m * 0.1, edge_z = 32.0 + px_per_m * 0.05;
  int mixed = 0;
  for (const ViewBlock& block : shaped.model->blocks()) {
    if (!block.is_mixed) continue;
    ++mixed;
    const int left = static_cast<int>(block.pixels[0]) % 64,
              top = static_cast<int>(block.pixels[0]) / 64;
    double sum = 0.0;
    for (const ViewPart& part : block.parts) {
      const bool is_right = part.surface % 2, is_high = part.surface / 2;
      const double x = std::clamp((edge_x - left) / 8.0, 0.0, 1.0),
                   z = std::clamp((edge_z - top) / 8.0, 0.0, 1.0);
      EXPECT_NEAR(part.share, (is_right ? 1.0 - x : x) * (is_high ? z : 1.0 - z), 1e-12);
      sum += part.share;
    }
    EXPECT_NEAR(sum, 1.0, 1e-12);
  }
  EXPECT_GE(mixed, 10);
}

TEST(MixedWindows, HideWhatStandsBehind) {
  const Scene scene = room_with_block();
  const ShapedScene shaped = shaped_scene(scene, {}, 0.34);
  // Shares of squares that see lit surfaces only add up to one, blocks before walls or not.
  int with_block = 0;
  for (const ViewBlock& block : shaped.model->blocks()) {
    double sum = 0.0;
    bool has_block = false;
    for (const ViewPart& part : block.parts) {
      sum += part.share;
      has_block = has_block || (part.surface >= 4 && part.surface <= 9);
    }
    EXPECT_NEAR(sum, 1.0, 1e-9);
    with_block += has_block && block.parts.size() > 1;
  }
  EXPECT_GE(with_block, 5);
}

}  // namespace
}  // namespace truebox

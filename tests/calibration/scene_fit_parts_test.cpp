// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>

#include "calibration/scene_fit_cases.h"
#include "fit/identifiability.h"
#include "fit/joint_whitening.h"
#include "fit/response_curve.h"
#include "fit/scene_fit_problem.h"
#include "fit/view_blocks.h"

namespace truebox {
namespace {

using testing::HasSubstr;

TEST(Whiten, TurnsTheJointCovarianceIntoUnity) {
  const Eigen::VectorXd sigma = (Eigen::VectorXd(5) << 0.5, 1.0, 2.0, 0.1, 0.7).finished();
  const std::vector<CommonMode> regions = {{{0, 2, 3}, {0.3, 1.5, 0.2}}, {{1}, {4.0}}};
  Eigen::MatrixXd covariance = sigma.array().square().matrix().asDiagonal();
  for (const CommonMode& region : regions)
    for (std::size_t i = 0; i < region.rows.size(); ++i)
      for (std::size_t j = 0; j < region.rows.size(); ++j)
        covariance(region.rows[i], region.rows[j]) += region.common[i] * region.common[j];
  Eigen::MatrixXd w = Eigen::MatrixXd::Identity(5, 5);
  whiten(sigma, regions, w);
  // Rounding: a few operations on numbers near 1.
  EXPECT_LT(
      (w * covariance * w.transpose() - Eigen::MatrixXd::Identity(5, 5)).cwiseAbs().maxCoeff(),
      1e-13);
}

TEST(ResponseCurve, WithUnitGammasIsLinear) {
  const ResponseCurve curve(4, 2.0, 0.8);
  for (const double x : {1e-5, 0.01, 0.3, 0.8, 2.0})
    EXPECT_NEAR(curve.at(x, {1, 1, 1, 1}).reading, x, 1e-14 * x);
}

TEST(ResponseCurve, WithEqualGammasIsAPowerLaw) {
  const ResponseCurve curve(3, 2.0, 1.0);
  for (const double x : {1e-4, 0.02, 0.5, 1.0})
    EXPECT_NEAR(curve.at(x, {0.45, 0.45, 0.45}).reading, std::pow(x, 0.45), 1e-13);
}

TEST(ResponseCurve, RisesEverywhereAndHasItsDerivatives) {
  const ResponseCurve curve(3, 2.0, 1.0);
  std::vector<double> gammas = {0.3, 1.2, 2.5};
  double before = 0.0;
  for (double x = 0.003; x < 1.5; x *= 1.07) {
    const auto value = curve.at(x, gammas);
    EXPECT_GT(value.reading, before);
    before = value.reading;
    const double h = 1e-6 * x;
    // Central differences: h^2 of curvature and rounding over h.
    EXPECT_NEAR((curve.at(x + h, gammas).reading - curve.at(x - h, gammas).reading) / (2 * h),
                value.by_exposure, 1e-6 * value.by_exposure);
    for (std::size_t j = 0; j < gammas.size(); ++j) {
      auto up = gammas, down = gammas;
      up[j] += 1e-6;
      down[j] -= 1e-6;
      EXPECT_NEAR((curve.at(x, up).reading - curve.at(x, down).reading) / 2e-6, value.by_gamma[j],
                  1e-7);
    }
  }
}

TEST(ResponseCurve, IsBlackWithoutLight) {
  EXPECT_EQ(ResponseCurve(2, 2.0, 1.0).at(0.0, {1.0, 1.0}).reading, 0.0);
}

TEST(SpectralBasis, KeepsSpectraBetweenTheirCoefficients) {
  const auto bands = WavelengthGrid::uniform(400, 700, 10);
  for (const auto basis : {SpectralBasis::bands, SpectralBasis::constant, SpectralBasis::linear,
                           SpectralBasis::bspline}) {
    const Eigen::MatrixXd m = spectral_basis(basis, 6, bands);
    EXPECT_GE(m.minCoeff(), 0.0);
    EXPECT_LT((m.rowwise().sum().array() - 1.0).abs().maxCoeff(), 1e-14);
  }
}

TEST(SpectralBasis, OfLinesAndSplinesHoldsStraightLines) {
  const auto bands = WavelengthGrid::uniform(400, 700, 10);
  Eigen::VectorXd line(31);
  for (int b = 0; b < 31; ++b) line[b] = 0.2 + 0.01 * b;
  for (const auto basis : {SpectralBasis::linear, SpectralBasis::bspline}) {
    const Eigen::MatrixXd m = spectral_basis(basis, 6, bands);
    const Eigen::VectorXd c = m.householderQr().solve(line);
    EXPECT_LT((m * c - line).cwiseAbs().maxCoeff(), 1e-13);
  }
}

TEST(PriorOfSpectra, KnowsWhatIsAlikeInThem) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd spectra(4000, 3);
  for (int i = 0; i < spectra.rows(); ++i) {
    const double level = 0.5 + 0.1 * normal(random);
    spectra.row(i) << level, level + 0.02 * normal(random), level;
  }
  const SpectralPrior prior = prior_of_spectra(spectra, 0.001);
  // Standard errors of 4000 draws: 0.1 / 63 of the mean, sqrt(2 / 4000) = 2.2 % of a variance.
  EXPECT_NEAR(prior.mean[1], 0.5, 0.005);
  EXPECT_NEAR(prior.covariance(0, 2), 0.01, 0.001);
  EXPECT_NEAR(prior.covariance(1, 1) - prior.covariance(0, 0), 0.0004, 0.0003);
}

std::vector<ParameterName> names() {
  return {{"emission scale", "emission scale", "emissions"},
          {"reflectance red", "reflectance of red", "reflectances"},
          {"reflectance green", "reflectance of green", "reflectances"}};
}

TEST(Identify, InvertsTheNormalMatrix) {
  Eigen::MatrixXd j = Eigen::MatrixXd::Random(20, 3);
  j.col(1) *= 1e6;  // units must not matter
  const Identifiability known = identify(j, Eigen::Vector3d::Ones());
  const Eigen::MatrixXd unity = known.covariance * (j.transpose() * j);
  EXPECT_TRUE(known.null_directions.empty());
  EXPECT_LT((unity - Eigen::MatrixXd::Identity(3, 3)).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(Identify, NamesWhatCannotBeToldApart) {
  Eigen::MatrixXd j = Eigen::MatrixXd::Random(20, 3);
  j.col(0) = j.col(1) + j.col(2);
  const Identifiability known = identify(j, Eigen::Vector3d::Ones());
  ASSERT_EQ(known.null_directions.size(), 1u);
  EXPECT_EQ(describe_direction(known.null_directions[0], Eigen::Vector3d::Ones(), names()),
            "all reflectances against emission scale");
  for (int k = 0; k < 3; ++k) {
    EXPECT_FALSE(known.determined[static_cast<std::size_t>(k)]);
    EXPECT_EQ(known.covariance(k, k), 0.0) << "no uncertainty may be claimed";
  }
}

TEST(Identify, LeavesTheDeterminedOnesTheirUncertainty) {
  Eigen::MatrixXd j = Eigen::MatrixXd::Zero(3, 3);
  j(0, 0) = j(0, 1) = 1.0;  // only the sum of the first two is read
  j(1, 2) = 2.0;
  const Identifiability known = identify(j, Eigen::Vector3d::Ones());
  EXPECT_FALSE(known.determined[0]);
  EXPECT_TRUE(known.determined[2]);
  EXPECT_NEAR(known.covariance(2, 2), 0.25, 1e-14);
}

TEST(Identify, SaysThatAParameterMovesNothing) {
  Eigen::MatrixXd j = Eigen::MatrixXd::Random(9, 3);
  j.col(2).setZero();
  const Identifiability known = identify(j, Eigen::Vector3d::Ones());
  ASSERT_EQ(known.null_directions.size(), 1u);
  EXPECT_EQ(describe_direction(known.null_directions[0], Eigen::Vector3d::Ones(), names()),
            "reflectance of green");
  EXPECT_TRUE(known.determined[0]);
}

TEST(DescribeDirection, SaysTogetherWhereSignsAgree) {
  EXPECT_EQ(describe_direction(Eigen::Vector3d(0.5, 0.6, 0.4), Eigen::Vector3d::Ones(), names()),
            "emission scale and all reflectances together");
}

TEST(MeanOverBlock, IsExactForAPlaneOfLight) {
  PixelBlock block;
  Eigen::VectorXd light(7);
  for (int k = 0; k < 7; ++k) {
    block.points.emplace_back(0.1 * k, 0.03 * k * k, 2.0);
    light[k] = 3.0 + 2.0 * block.points.back().x() - block.points.back().y();
  }
  block.centre = Vec3(0.7, 0.2, 2.0);
  const SampledMean mean = mean_over_block(block, light);
  EXPECT_NEAR(mean.value, 3.0 + 1.4 - 0.2, 1e-13);
  EXPECT_LT(mean.standard_uncertainty, 1e-13);
}

TEST(MeanOverBlock, DoesNotTakeRoundingForADirection) {
  PixelBlock block;
  Eigen::VectorXd light(9);
  for (int k = 0; k < 9; ++k) {  // a wall at x = 5.56 whose points are off by a rounding
    block.points.emplace_back(5.56 + (k % 2 ? 1e-15 : -1e-15), 0.1 * (k % 3), 0.1 * (k / 3));
    light[k] = 1.0 + 0.1 * std::sin(7.0 * k);
  }
  block.centre = Vec3(5.56 + 3e-15, 0.1, 0.1);
  EXPECT_NEAR(mean_over_block(block, light).value, light.mean(), 0.01);
}

TEST(MeanOverBlock, IsUncertainAcrossAShadowEdge) {
  PixelBlock block;
  Eigen::VectorXd light(16);
  for (int k = 0; k < 16; ++k) {
    block.points.emplace_back(k % 4, k / 4, 0.0);
    light[k] = k % 4 < 2 ? 0.0 : 1.0;
  }
  block.centre = Vec3(1.5, 1.5, 0.0);
  EXPECT_GT(mean_over_block(block, light).standard_uncertainty, 0.04);
}

TEST(SurfaceMeans, AreThoseOfAFurnace) {
  // Every wall emits M and reflects rho: B = M / (1 - rho) everywhere.
  const Scene scene = tiny::cube(2.0, 0.6, 3.0);
  SceneModelOptions options = cube_grid(0.5);
  SceneModel model(scene, options);
  EXPECT_EQ(model.add_surface_means(), 0u);
  ASSERT_EQ(model.blocks().size(), 6u);
  const BlockRadiosity all = model.radiosity(model.state(), nullptr);
  // Form factors: quadrature between walls that share an edge.
  for (Eigen::Index i = 0; i < all.value.rows(); ++i) EXPECT_NEAR(all.value(i, 0), 7.5, 7.5e-4);
}

TEST(SurfaceMeans, WeighUnequalElementsByTheirAreas) {
  // Direct light alone, rho = 1/2: the mean irradiance of the floor is its view factor to the
  // ceiling, that of opposite faces of a cube (Hottel 1930). The floor is one surface of two
  // trapezoids, so that its elements differ in size.
  Scene scene = lit_cube({{.5, .5, .5, .5, .5, .5}});
  for (Surface& s : scene.surfaces)
    if (s.name.starts_with("ceiling")) s.material = 6;
  Surface& floor = scene.surfaces[4];
  floor.pieces = {{{0, 0, 0}, {.3, 0, 0}, {.1, 1, 0}, {0, 1, 0}},
                  {{.3, 0, 0}, {1, 0, 0}, {1, 1, 0}, {.1, 1, 0}}};
  SceneModel model(scene, cube_grid(0.25));
  model.add_surface_means();
  SceneState state = model.state();
  state.interreflection = false;
  const BlockRadiosity all = model.radiosity(state, nullptr);
  const double root = std::sqrt(2.0);
  const double view_factor =
      2.0 / M_PI *
      (0.5 * std::log(4.0 / 3.0) + 2.0 * root * std::atan(1.0 / root) - 2.0 * std::atan(1.0));
  double area = 0.0, weights = 0.0;
  for (const auto& [element, weight] : model.blocks()[4].parts[0].weights) {
    EXPECT_NEAR(weight, model.mesh().patches[element].area_m2, 1e-14);  // of a floor of 1 m^2
    area += model.mesh().patches[element].area_m2;
    weights += weight;
  }
  EXPECT_NEAR(area, 1.0, 1e-14);
  EXPECT_NEAR(weights, 1.0, 1e-14);
  // The mean over an element is a quadrature of a smooth function.
  EXPECT_NEAR(all.value(4, 0), 0.5 * view_factor, 1e-5);
}

TEST(SurfaceMeans, LeaveOutOpenings) {
  Scene scene = tiny::cube(1.0, 0.5, 1.0);
  scene.surfaces.back().is_opening = true;
  SceneModel model(scene, cube_grid(0.5));
  model.add_surface_means();
  EXPECT_EQ(model.blocks().size(), 5u);
}

}  // namespace
}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "transport/sensitivity.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "support/tiny_scenes.h"

namespace truebox {
namespace {

using Eigen::Index;

// A cube with a block, four bands; walls 2 and 3 share a material that the derivatives are for.
class Sensitivity : public testing::Test {
 protected:
  static constexpr Index kBands = 4;
  FormFactors f_;
  BandMatrix rho_, direct_, exitance_, b_, irradiance_;
  std::vector<char> painted_;
  SolveOptions options_;

  void SetUp() override {
    const Scene scene = tiny::cube_with_block(1.0, 0.5);
    const PatchMesh mesh = uniform_mesh(scene, 0.25);
    f_ = form_factors(mesh, scene, Visibility(mesh, scene), {});
    const Index n = f_.size();
    std::mt19937_64 random(81);
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    rho_.resize(n, kBands);
    direct_.resize(n, kBands);
    exitance_ = BandMatrix::Zero(n, kBands);
    for (Index i = 0; i < n; ++i) {
      const std::size_t surface = mesh.surface_of(mesh.patches[static_cast<std::size_t>(i)]);
      painted_.push_back(surface == 2 || surface == 3);
      for (Index k = 0; k < kBands; ++k) {
        rho_(i, k) = painted_.back() ? 0.2 + 0.2 * static_cast<double>(k) : 0.55;
        direct_(i, k) = uniform(random);
        if (surface == 1) exitance_(i, k) = 1.0 + uniform(random);
      }
    }
    options_.relative_bound = 1e-12;
    b_ = solve(rho_, exitance_, &irradiance_);
  }

  BandMatrix solve(const BandMatrix& rho, const BandMatrix& exitance,
                   BandMatrix* irradiance = nullptr) const {
    const BandMatrix source = exitance + rho.cwiseProduct(direct_);
    BandMatrix b;
    EXPECT_EQ(solve_radiosity(f_, rho, source, options_, b, {}, irradiance).outcome,
              SolveOutcome::converged);
    return b;
  }
};

TEST_F(Sensitivity, ToAReflectanceIsThatOfCentralDifferences) {
  const DenseExchange exchange(f_);
  BandMatrix derivative;
  reflectance_sensitivity({exchange, rho_, direct_, irradiance_}, painted_, options_, derivative);
  constexpr double kStep = 1e-4;
  BandMatrix more = rho_, less = rho_;
  for (Index i = 0; i < rho_.rows(); ++i)
    if (painted_[static_cast<std::size_t>(i)]) {
      more.row(i).array() += kStep;
      less.row(i).array() -= kStep;
    }
  const BandMatrix difference = (solve(more, exitance_) - solve(less, exitance_)) / (2.0 * kStep);
  // Central differences: step^2 / 6 of the third derivative, about 6 B / (1 - rho)^3 < 60 here, and
  // solver error 1e-12 / step.
  EXPECT_LT((derivative - difference).cwiseAbs().maxCoeff(), 10.0 * kStep * kStep + 1e-7);
  // More reflectance, more light; none where the block buries the floor.
  EXPECT_GE(derivative.minCoeff(), 0.0);
  EXPECT_GT(derivative.maxCoeff(), 0.0);
}

TEST_F(Sensitivity, ToAnExitanceIsThatOfADifference) {
  const DenseExchange exchange(f_);
  BandMatrix derivative;
  exitance_sensitivity({exchange, rho_, direct_, irradiance_}, painted_, options_, derivative);
  BandMatrix more = exitance_;
  for (Index i = 0; i < more.rows(); ++i)
    if (painted_[static_cast<std::size_t>(i)]) more.row(i).array() += 1.0;
  // B is linear in E: a whole unit is as good as a small step.
  EXPECT_LT((derivative - (solve(rho_, more) - b_)).cwiseAbs().maxCoeff(), 1e-10);
}

TEST_F(Sensitivity, AdjointGivesThePathOfEveryElementInOneSolve) {
  const DenseExchange exchange(f_);
  std::mt19937_64 random(82);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  BandMatrix weight(rho_.rows(), kBands);  // of either sign: J need not be a mean
  for (Index i = 0; i < weight.rows(); ++i)
    for (Index k = 0; k < kBands; ++k) weight(i, k) = uniform(random);
  const SolvedSystem system{exchange, rho_, direct_, irradiance_};
  const AdjointSensitivity adjoint = adjoint_sensitivity(system, weight, options_);
  ASSERT_EQ(adjoint.summary.outcome, SolveOutcome::converged);
  BandMatrix by_rho, by_exitance;
  reflectance_sensitivity(system, painted_, options_, by_rho);
  exitance_sensitivity(system, painted_, options_, by_exitance);
  for (Index k = 0; k < kBands; ++k) {
    double rho_sum = 0.0, exitance_sum = 0.0;
    for (Index i = 0; i < weight.rows(); ++i)
      if (painted_[static_cast<std::size_t>(i)]) {
        rho_sum += adjoint.by_reflectance(i, k);
        exitance_sum += adjoint.by_exitance(i, k);
      }
    // Both are exact up to the solver's bound 1e-12, amplified by 1 / (1 - rho) and n elements.
    EXPECT_NEAR(rho_sum, weight.col(k).dot(by_rho.col(k)), 1e-8);
    EXPECT_NEAR(exitance_sum, weight.col(k).dot(by_exitance.col(k)), 1e-8);
  }
}

TEST_F(Sensitivity, FurnaceHasAClosedForm) {
  // B = E / (1 - rho): dB/d rho = E / (1 - rho)^2, dB/dE = 1 / (1 - rho), for all elements at once.
  const Scene cube = tiny::cube(1.0, 0.5);
  const PatchMesh mesh = uniform_mesh(cube, 0.5);
  FormFactorOptions exact;
  exact.relative_tolerance = 1e-13;
  exact.occlusion = false;
  const FormFactors f = form_factors(mesh, cube, Visibility(mesh, cube), exact);
  const DenseExchange exchange(f);
  const std::vector<char> all(mesh.size(), 1);
  for (const double rho : {0.0, 0.5, 0.99}) {
    const BandMatrix r = BandMatrix::Constant(f.size(), 1, rho);
    const BandMatrix none = BandMatrix::Zero(f.size(), 1), one = BandMatrix::Ones(f.size(), 1);
    BandMatrix b, irradiance, derivative;
    solve_radiosity(f, r, one, options_, b, {}, &irradiance);
    reflectance_sensitivity({exchange, r, none, irradiance}, all, options_, derivative);
    const double by_rho = 1.0 / ((1.0 - rho) * (1.0 - rho));
    // Closure 1e-14 and bound 1e-12, each amplified once more by 1 / (1 - rho).
    EXPECT_LT((derivative.array() - by_rho).abs().maxCoeff(), 1e-11 * by_rho / (1.0 - rho));
    exitance_sensitivity({exchange, r, none, irradiance}, all, options_, derivative);
    EXPECT_LT((derivative.array() - 1.0 / (1.0 - rho)).abs().maxCoeff(), 1e-11 / (1.0 - rho));
  }
}

}  // namespace
}  // namespace truebox

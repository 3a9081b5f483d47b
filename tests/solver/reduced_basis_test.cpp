// SPDX-License-Identifier: BSD-3-Clause
#include "transport/reduced_basis.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "support/direct_solution.h"
#include "support/tiny_scenes.h"
#include "transport/band_product.h"
#include "transport/band_systems.h"
#include "transport/visibility.h"

namespace truebox {
namespace {

using Eigen::Index;

FormFactors room_with_block(double edge_m) {
  const Scene scene = tiny::cube_with_block(1.0, 0.5);
  const PatchMesh mesh = uniform_mesh(scene, edge_m);
  FormFactorOptions options;
  options.relative_tolerance = 1e-13;
  return form_factors(mesh, scene, Visibility(mesh, scene), options);
}

// Five bands more than two vectors of eight hold, unknowns that join by ones and by fives.
TEST(BandSystems, SolvesEveryBandAsItsOwnFactorisationDoes) {
  constexpr Index kBands = 21, kSize = 23;
  const BandMatrix a = BandMatrix::Random(kSize, kSize);
  const BandMatrix k = a * a.transpose() / (a * a.transpose()).norm();
  const BandMatrix scale = BandMatrix::Random(kSize, kBands).cwiseAbs();
  BandSystems systems(kBands);
  for (Index old = 0; old < kSize;) {
    const Index more = old % 2 == 0 ? 1 : std::min<Index>(5, kSize - old);
    ASSERT_TRUE(systems.append(k.block(old, 0, more, old + more), scale.middleRows(old, more)));
    old += more;
    const BandMatrix f = BandMatrix::Random(old, kBands), v = systems.solve(f);
    for (Index band = 0; band < kBands; ++band) {
      const Eigen::VectorXd s = scale.col(band).head(old);
      const Eigen::MatrixXd system =
          Eigen::MatrixXd::Identity(old, old) -
          s.asDiagonal() * Eigen::MatrixXd(k.topLeftCorner(old, old)) * s.asDiagonal();
      // Eigenvalues lie in [0, 1]: a few digits of rounding.
      EXPECT_LE((v.col(band) - system.llt().solve(f.col(band))).norm(), 1e-12 * f.col(band).norm());
    }
  }
}

TEST(BandSystems, SaysWhereASystemIsNotPositiveDefinite) {
  BandSystems systems(9);
  BandMatrix scale = BandMatrix::Constant(1, 9, 0.5);
  EXPECT_TRUE(systems.append(BandMatrix::Constant(1, 1, 1.0), scale));
  scale(0, 8) = 2.0;  // 1 - 4 in the last band alone
  EXPECT_FALSE(systems.append(BandMatrix::Constant(1, 2, 1.0), scale));
}

TEST(BlockProduct, IsTheProductWithTheirColumnsAlone) {
  const Index n = 150;
  const Eigen::MatrixXd half = Eigen::MatrixXd::Random(n, n), s = half + half.transpose();
  std::vector<Index> runs, scattered, one{149};
  for (Index i = 0; i < n; ++i) {
    if (i < 40 || (i >= 100 && i < 137)) runs.push_back(i);
    if (i % 3 == 1) scattered.push_back(i);
  }
  std::vector<ElementBlock> blocks;
  for (const std::vector<Index>* elements : {&runs, &scattered, &one, &runs})
    blocks.push_back({*elements, BandMatrix::Random(static_cast<Index>(elements->size()),
                                                    blocks.size() == 2 ? 1 : 27)});
  const BandMatrix found = block_product(s, blocks);
  ASSERT_EQ(found.cols(), 27 + 27 + 1 + 27);
  Index place = 0;
  for (const ElementBlock& block : blocks) {
    const Eigen::MatrixXd expected = s(Eigen::all, block.elements) * block.x;
    EXPECT_LE((found.middleCols(place, block.x.cols()) - expected).cwiseAbs().maxCoeff(),
              1e-15 * n * 10);  // sums of at most 77 products below 2
    place += block.x.cols();
  }
}

// Three materials and forty bands: what a measured scene looks like.
class ReducedBasis : public testing::Test {
 protected:
  FormFactors f_;
  Index n_;
  static constexpr Index kBands = 40;
  BandMatrix rho_, source_;

  ReducedBasis() { mesh(0.25); }

  // Every band is off by no more than its bound and what elimination loses: `rounding` of the
  // largest radiosity, the condition 1 / (1 - rho) times 2e-16, and a reserve.
  void expect_bounds_hold(const BandMatrix& b, const SolveSummary& summary, double rounding) const {
    const BandMatrix truth = direct_solution(f_, rho_, source_);
    for (Index k = 0; k < kBands; ++k)
      EXPECT_LE((b.col(k) - truth.col(k)).cwiseAbs().maxCoeff(),
                summary.error_bound[k] + rounding * truth.col(k).maxCoeff() + 1e-14)
          << k;
  }

  void mesh(double edge_m) {
    f_ = room_with_block(edge_m);
    n_ = f_.size();
    rho_.resize(n_, kBands);
    source_ = BandMatrix::Zero(n_, kBands);
    for (Index i = 0; i < n_; ++i)
      for (Index k = 0; k < kBands; ++k) {
        const double t = static_cast<double>(k) / (kBands - 1);
        rho_(i, k) = i % 3 == 0   ? 0.72 + 0.05 * std::sin(9.0 * t)
                     : i % 3 == 1 ? 0.05 + 0.6 / (1.0 + std::exp(-20.0 * (t - 0.6)))
                                  : 0.1 + 0.4 * std::exp(-std::pow((t - 0.4) / 0.1, 2));
        if (i < 4) source_(i, k) = 0.2 + t;
      }
  }
};

TEST_F(ReducedBasis, HoldsItsBoundInEveryBand) {
  const BandMatrix truth = direct_solution(f_, rho_, source_);
  for (const double bound : {1e-3, 1e-6, 1e-9, 1e-11}) {
    SolveOptions options;
    options.relative_bound = bound;
    BandMatrix b, irradiance;
    const SolveSummary summary = solve_radiosity(f_, rho_, source_, options, b, {}, &irradiance);
    ASSERT_EQ(summary.outcome, SolveOutcome::converged);
    for (Index k = 0; k < kBands; ++k) {
      EXPECT_LE((b.col(k) - truth.col(k)).cwiseAbs().maxCoeff(), summary.error_bound[k] + 1e-14);
      EXPECT_LE(summary.error_bound[k], bound * b.col(k).maxCoeff() * (1 + 1e-12));
      const Eigen::VectorXd exact = (f_.exchange_area_m2 * truth.col(k)).cwiseQuotient(f_.area_m2);
      EXPECT_LE((irradiance.col(k) - exact).cwiseAbs().maxCoeff(),
                summary.error_bound[k] * f_.summary.row_sum_max + 1e-14);
    }
  }
}

TEST_F(ReducedBasis, ReadsAFractionOfTheMatrix) {
  mesh(0.125);
  SolveOptions shared, each;
  each.share_bands = false;
  BandMatrix b, c;
  const SolveSummary few = solve_radiosity(f_, rho_, source_, shared, b);
  const SolveSummary all = solve_radiosity(f_, rho_, source_, each, c);
  ASSERT_EQ(few.outcome, SolveOutcome::converged);
  EXPECT_EQ(all.bands_reduced, 0);
  EXPECT_GT(few.bands_reduced, 0);
  // Some ninety functions, each on a third of the elements, for forty bands.
  EXPECT_LT(few.matrix_passes, 1.5);
  EXPECT_GT(all.matrix_passes, 10.0);
  for (Index k = 0; k < kBands; ++k)
    EXPECT_LE((b.col(k) - c.col(k)).cwiseAbs().maxCoeff(), few.error_bound[k] + all.error_bound[k]);
}

TEST_F(ReducedBasis, ReachesABoundNearRounding) {
  rho_ *= 0.999 / rho_.maxCoeff();
  SolveOptions options;
  options.relative_bound = 1e-12;
  BandMatrix b;
  const SolveSummary summary = solve_radiosity(f_, rho_, source_, options, b);
  ASSERT_EQ(summary.outcome, SolveOutcome::converged) << summary.brief();
  expect_bounds_hold(b, summary, 1e-12);
}

TEST_F(ReducedBasis, LeavesManyReflectancesToOtherMethods) {
  for (Index i = 0; i < n_; ++i) rho_.row(i) *= 1.0 - 0.3 * static_cast<double>(i) / n_;
  BandMatrix b;
  const SolveSummary summary = solve_radiosity(f_, rho_, source_, {}, b);
  EXPECT_EQ(summary.outcome, SolveOutcome::converged);
  EXPECT_EQ(summary.bands_reduced, 0);
  expect_bounds_hold(b, summary, 0.0);
}

TEST_F(ReducedBasis, MultipliesEveryBandWhereSpectraHaveNothingInCommon) {
  rho_ = (0.45 + 0.45 * BandMatrix::Random(n_, kBands).array()).matrix();
  source_ = BandMatrix::Random(n_, kBands).cwiseAbs();
  BandMatrix b;
  const SolveSummary summary = solve_radiosity(f_, rho_, source_, {}, b);
  ASSERT_EQ(summary.outcome, SolveOutcome::converged);
  EXPECT_LE(summary.bands_reduced, kBands / 8);
  expect_bounds_hold(b, summary, 0.0);
}

TEST_F(ReducedBasis, StatesABoundThatHoldsWhereIterationsEndEarly) {
  SolveOptions options;
  options.iteration_limit = 3;
  BandMatrix b;
  const SolveSummary summary = solve_radiosity(f_, rho_, source_, options, b);
  EXPECT_EQ(summary.outcome, SolveOutcome::iteration_limit);
  const BandMatrix truth = direct_solution(f_, rho_, source_);
  for (Index k = 0; k < kBands; ++k) {
    const double error = (b.col(k) - truth.col(k)).cwiseAbs().maxCoeff();
    EXPECT_LE(error, summary.error_bound[k]);
    EXPECT_GT(error, 1e-3 * summary.error_bound[k]);
  }
}

TEST_F(ReducedBasis, TakesBandsThatHaveNothingInCommon) {
  // A black band, a nearly white one, one without light and emission over twelve decades.
  rho_.col(3).setZero();
  rho_.col(7).setConstant(0.9999);
  source_.col(11).setZero();
  source_.col(20) *= 1e-6;
  source_.col(21) *= 1e6;
  BandMatrix b;
  const SolveSummary summary = solve_radiosity(f_, rho_, source_, {}, b);
  ASSERT_EQ(summary.outcome, SolveOutcome::converged);
  expect_bounds_hold(b, summary, 1e-10);
}

// Residuals of 1e-13 of the radiosity, where rounding begins.
TEST_F(ReducedBasis, TakesABandThatIsNearlyWhite) {
  rho_.col(9).setConstant(0.999999);
  BandMatrix b;
  const SolveSummary summary = solve_radiosity(f_, rho_, source_, {}, b);
  ASSERT_EQ(summary.outcome, SolveOutcome::converged) << summary.brief();
  expect_bounds_hold(b, summary, 1e-9);
}

TEST_F(ReducedBasis, KnowsNoUnitOfLength) {
  mesh(0.125);
  BandMatrix metres, other;
  const SolveSummary first = solve_radiosity(f_, rho_, source_, {}, metres);
  for (const double metres_each : {1e-6, 1e6}) {
    FormFactors scaled = f_;
    scaled.area_m2 *= metres_each * metres_each;
    scaled.exchange_area_m2 *= metres_each * metres_each;
    const SolveSummary summary = solve_radiosity(scaled, rho_, source_, {}, other);
    EXPECT_EQ(summary.outcome, SolveOutcome::converged);
    EXPECT_NEAR(summary.matrix_passes, first.matrix_passes, 0.1 * first.matrix_passes);
    for (Index k = 0; k < kBands; ++k)
      EXPECT_LE((other.col(k) - metres.col(k)).cwiseAbs().maxCoeff(),
                first.error_bound[k] + summary.error_bound[k]);
  }
}

TEST_F(ReducedBasis, HasNothingToDoWithoutLight) {
  source_.setZero();
  BandMatrix b;
  const SolveSummary summary = solve_radiosity(f_, rho_, source_, {}, b);
  EXPECT_EQ(summary.outcome, SolveOutcome::converged);
  EXPECT_EQ(summary.matrix_passes, 0.0);
  EXPECT_EQ(b.cwiseAbs().maxCoeff(), 0.0);
}

}  // namespace
}  // namespace truebox

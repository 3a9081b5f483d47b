// SPDX-License-Identifier: BSD-3-Clause
#include "fit/chart_fit.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "uncertainty/coverage.h"

namespace truebox {
namespace {

using testing::HasSubstr;

/// A chart of 4 x 6 patches, the last row known, under a tilted, curved light: truth first.
struct Truth {
  std::vector<double> rho;
  double gain = 170.0, veil = 0.0;
  std::vector<double> field = {-0.18, 0.06, -0.05, 0.02, -0.04};
  double relative_noise = 0.0, standard_u = 0.01;
};

Truth some_truth() {
  Truth truth;
  for (int p = 0; p < 24; ++p)
    truth.rho.push_back(p < 18 ? 0.05 + 0.045 * p : 0.08 + 0.15 * (p - 18));
  return truth;
}

ChartProblem synthetic(const Truth& truth, int blocks_a_side, std::mt19937* random) {
  ChartProblem problem;
  std::normal_distribution<double> normal;
  for (std::size_t p = 0; p < 24; ++p) {
    problem.patches.push_back("patch " + std::to_string(p + 1));
    problem.standards.emplace_back();
    if (p >= 18)
      problem.standards[p] = Estimate{
          truth.rho[p] + (random ? truth.standard_u * normal(*random) : 0.0), truth.standard_u};
    const double cx = -0.83 + 0.333 * static_cast<double>(p % 6),
                 cy = -0.75 + 0.5 * static_cast<double>(p / 6);
    for (int i = 0; i < blocks_a_side * blocks_a_side; ++i) {
      PatchBlock block;
      block.patch = p;
      block.x = cx + 0.1 * (2.0 * (i % blocks_a_side + 0.5) / blocks_a_side - 1.0);
      block.y = cy + 0.17 * (2.0 * (i / blocks_a_side + 0.5) / blocks_a_side - 1.0);
      const auto terms = field_terms(2, block.x, block.y);
      double light = 1.0;
      for (std::size_t k = 0; k < terms.size(); ++k) light += terms[k] * truth.field[k];
      const double exact = truth.gain * (truth.rho[p] + truth.veil) * light;
      block.standard_uncertainty =
          (truth.relative_noise > 0.0 ? truth.relative_noise : 0.01) * exact;
      block.value = exact + (random ? block.standard_uncertainty * normal(*random) : 0.0);
      problem.blocks.push_back(block);
    }
  }
  return problem;
}

TEST(FieldTerms, AreTheMonomialsByDegree) {
  EXPECT_TRUE(field_terms(0, 2.0, 3.0).empty());
  EXPECT_THAT(field_terms(2, 2.0, 3.0), testing::ElementsAre(2.0, 3.0, 4.0, 6.0, 9.0));
  EXPECT_EQ(field_terms(3, 1.0, 1.0).size(), 9u);
}

TEST(ChartFit, RecoversTheTruthWithoutNoise) {
  for (const bool veil : {false, true}) {
    Truth truth = some_truth();
    truth.veil = veil ? 0.03 : 0.0;
    const ChartFit fit =
        fit_chart(synthetic(truth, 3, nullptr), {.field_order = 2, .fit_veil = veil});
    ASSERT_EQ(fit.summary.outcome, Outcome::converged) << fit.summary.brief();
    for (std::size_t p = 0; p < 24; ++p)
      EXPECT_NEAR(fit.reflectance[p].value, truth.rho[p], 1e-6) << p;  // 1: the requirement
    EXPECT_NEAR(fit.gain, truth.gain, 1e-6 * truth.gain);
    EXPECT_NEAR(fit.veil.value, truth.veil, 1e-6);
    for (std::size_t k = 0; k < truth.field.size(); ++k)
      EXPECT_NEAR(fit.field[k], truth.field[k], 1e-6) << k;
  }
}

TEST(ChartFit, AnalyticJacobianMatchesTheNumericOne) {
  // Ridders' differences reach about 1e-9 relative on a product of three factors.
  for (int order : {0, 2, 3})
    EXPECT_LT(largest_jacobian_error(synthetic(some_truth(), 2, nullptr),
                                     {.field_order = order, .fit_veil = true}),
              1e-7)
        << order;
}

TEST(ChartFit, IntervalsCoverTheTruthAsOftenAsTheySay) {
  // 2000 fits of 18 unknown reflectances, seed 20264. The patches of one fit share its standards'
  // errors, so each patch is judged over the fits: the 18 coverages average to 95.4 % (2 sigma).
  // [0.93, 0.97] is the requirement; the standard deviation of the average is below 0.5 %.
  std::mt19937 random(20264);
  Truth truth = some_truth();
  truth.relative_noise = 0.02;
  std::size_t hits = 0, trials = 0;
  double chi2 = 0.0;
  const int fits = 2000;
  for (int i = 0; i < fits; ++i) {
    const ChartFit fit = fit_chart(synthetic(truth, 3, &random), {.field_order = 2});
    ASSERT_EQ(fit.summary.outcome, Outcome::converged) << i;
    chi2 += fit.summary.chi2_per_dof / fits;
    for (std::size_t p = 0; p < 18; ++p) {
      const Estimate& e = fit.reflectance[p];
      hits += std::abs(e.value - truth.rho[p]) <= 2.0 * e.standard_uncertainty;
      ++trials;
    }
  }
  const Coverage covered = coverage(hits, trials);
  EXPECT_GE(covered.fraction, 0.93);
  EXPECT_LE(covered.fraction, 0.97);
  // nu = 216 + 6 - 30 = 192 a fit: the mean of 2000 has a standard deviation of 0.0023; 5 sigma.
  EXPECT_NEAR(chi2, 1.0, 0.012);
}

TEST(ChartFit, ScatterBeyondTheStatedSigmaEnlargesTheUncertainty) {
  std::mt19937 random(20265);
  Truth truth = some_truth();
  truth.relative_noise = 0.03;
  truth.standard_u = 1e-4;  // so that the blocks rule the uncertainty
  ChartProblem problem = synthetic(truth, 3, &random);
  const double honest = fit_chart(problem, {}).reflectance[0].standard_uncertainty;
  for (PatchBlock& b : problem.blocks) b.standard_uncertainty /= 3.0;
  const ChartFit fit = fit_chart(problem, {});
  EXPECT_GT(fit.summary.chi2_per_dof, 7.0);
  EXPECT_NEAR(fit.reflectance[0].standard_uncertainty / honest, 1.0, 0.15);  // 3 sigma of chi^2/nu
}

TEST(ChartFit, WithoutStandardsNamesWhatIsNotDetermined) {
  ChartProblem problem = synthetic(some_truth(), 3, nullptr);
  for (auto& standard : problem.standards) standard.reset();
  ChartFit fit;
  ASSERT_NO_THROW(fit = fit_chart(problem, {}));
  EXPECT_EQ(fit.summary.outcome, Outcome::rank_deficient);
  EXPECT_THAT(fit.summary.null_direction, HasSubstr("gain"));
  EXPECT_THAT(fit.summary.brief(), HasSubstr("rank deficient"));
  for (const Estimate& e : fit.reflectance) EXPECT_EQ(e.standard_uncertainty, 0.0);
}

TEST(ChartFit, AVeilNeedsStandardsOfDifferentReflectance) {
  ChartProblem problem = synthetic(some_truth(), 3, nullptr);
  for (std::size_t p = 19; p < 24; ++p) problem.standards[p].reset();
  EXPECT_EQ(fit_chart(problem, {.fit_veil = false}).summary.outcome, Outcome::converged);
  EXPECT_EQ(fit_chart(problem, {.fit_veil = true}).summary.outcome, Outcome::rank_deficient);
}

TEST(ChartFit, APatchWithoutLightIsAtItsBoundNotCertain) {
  Truth truth = some_truth();
  ChartProblem problem = synthetic(truth, 3, nullptr);
  for (PatchBlock& b : problem.blocks)
    if (b.patch == 4) {
      b.value = -2.0;
      b.standard_uncertainty = 1.0;
    }
  const ChartFit fit = fit_chart(problem, {});
  ASSERT_EQ(fit.summary.outcome, Outcome::converged);
  EXPECT_TRUE(fit.at_bound[4]);
  EXPECT_EQ(fit.reflectance[4].value, 0.0);
  EXPECT_EQ(fit.reflectance[4].standard_uncertainty, 0.0);
  EXPECT_FALSE(fit.at_bound[5]);
  // The others keep their own uncertainty: one patch in the dark says little about them. 5 %: the
  // nine blocks of that patch no longer help to fix the illumination.
  const ChartFit lit = fit_chart(synthetic(truth, 3, nullptr), {});
  for (std::size_t p : {3u, 5u, 17u})
    EXPECT_NEAR(fit.reflectance[p].standard_uncertainty / lit.reflectance[p].standard_uncertainty,
                1.0, 0.05)
        << p;
}

TEST(ChartFit, AProblemThatCannotBeFittedSaysWhy) {
  ChartProblem problem = synthetic(some_truth(), 3, nullptr);
  problem.blocks[7].standard_uncertainty = 0.0;
  const ChartFit fit = fit_chart(problem, {});
  EXPECT_EQ(fit.summary.outcome, Outcome::invalid_problem);
  EXPECT_THAT(fit.summary.message, HasSubstr("patch 1"));
  EXPECT_EQ(FitSummary{}.outcome, Outcome::not_run);
  EXPECT_FALSE(FitSummary{}.usable());
}

}  // namespace
}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <cstdio>
#include <random>

#include "support/cornell_box.h"
#include "support/tiny_scenes.h"
#include "transport/prediction.h"

namespace truebox {
namespace {

TEST(PredictionBound, CoversTheDifferenceOfTwoPredictions) {
  // 1200 and 6000 elements, seeds of visibility apart: what they say of the same 200 points may
  // differ by the sum of their bounds. The bound is an estimate from three grids, not a theorem:
  // 99 % of the point-bands must lie within, and none by more than twice.
  constexpr double kCoverage = 0.99, kWorst = 2.0;
  const Scene scene = cornell_box_in_seven_bands();
  PredictOptions rough, fine;
  rough.elements = 1200;
  rough.form_factors.seed = 100;
  const Prediction a(scene, rough), b(scene, fine);
  ASSERT_EQ(a.outcome(), SolveOutcome::converged);
  ASSERT_EQ(b.outcome(), SolveOutcome::converged);
  const PatchMesh& mesh = b.fine().mesh;
  std::mt19937_64 random(71);
  std::vector<double> areas;
  for (std::size_t i = 0; i < mesh.size(); ++i) {
    const bool lit =
        b.fine().usable[i] && !scene.surfaces[mesh.surface_of(mesh.patches[i])].is_opening;
    areas.push_back(lit ? mesh.patches[i].area_m2 : 0.0);
  }
  std::discrete_distribution<std::size_t> pick(areas.begin(), areas.end());
  std::exponential_distribution<double> exponential;
  std::size_t compared = 0, covered = 0;
  double worst = 0.0, bound_sum = 0.0, value_sum = 0.0;
  for (int trial = 0; trial < 200; ++trial) {
    const Patch& patch = mesh.patches[pick(random)];
    Vec3 x = Vec3::Zero();
    double total = 0.0;
    for (std::uint32_t v : mesh.corners_of(patch)) {
      const double w = exponential(random);
      x += w * mesh.vertices[v];
      total += w;
    }
    x /= total;
    const Vec3& normal = mesh.plane_of(patch).normal;
    const BoundedIrradiance ea = a.irradiance_at(x, normal), eb = b.irradiance_at(x, normal);
    for (Eigen::Index k = 0; k < ea.value.size(); ++k) {
      if (eb.value[k] == 0.0) continue;
      const double ratio =
          std::abs(ea.value[k] - eb.value[k]) / (ea.error_bound[k] + eb.error_bound[k]);
      ++compared;
      covered += ratio <= 1.0;
      worst = std::max(worst, ratio);
      bound_sum += ea.error_bound[k];
      value_sum += ea.value[k];
    }
  }
  ASSERT_GT(compared, 1000u);
  const double share = static_cast<double>(covered) / static_cast<double>(compared);
  std::printf("%zu point-bands, %.2f %% within, worst %.2f of the bounds, mean bound %.2f %%\n",
              compared, 100.0 * share, worst, 100.0 * bound_sum / value_sum);
  EXPECT_GE(share, kCoverage);
  EXPECT_LE(worst, kWorst);
  EXPECT_LT(bound_sum / value_sum, 0.1) << "a bound so wide says nothing";
}

// Every grid makes the same error where the form factors' tolerance is coarser than the grids'
// difference: in a furnace, whose radiosity is E / (1 - rho) everywhere, all of it.
TEST(ErrorBound, HoldsWhatTheKernelsToleranceDoesToAFurnace) {
  constexpr double kRho = 0.5;
  const Scene scene = tiny::cube(1.0, kRho, 1.0);
  PredictOptions options;
  options.elements = 400;
  options.form_factors.relative_tolerance = 1e-2;
  const Prediction prediction(scene, options);
  ASSERT_EQ(prediction.outcome(), SolveOutcome::converged);
  const BandMatrix error = (prediction.radiosity().array() - 1.0 / (1.0 - kRho)).abs();
  const BandMatrix bound = prediction.radiosity_bound();
  EXPECT_GT(error.maxCoeff(), 1e-6) << "too good to show anything";
  for (Eigen::Index i = 0; i < error.rows(); ++i) EXPECT_LE(error(i, 0), bound(i, 0)) << i;
  EXPECT_LE(bound.maxCoeff(), 1e-2 / (1.0 - kRho)) << "a bound so wide says nothing";
}

}  // namespace
}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "transport/streamed_exchange.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "support/tiny_scenes.h"
#include "transport/prediction.h"

namespace truebox {
namespace {

using Eigen::Index;

TEST(StreamedExchange, GivesTheAnswerOfTheMatrixWithoutRoomForIt) {
  Scene scene = tiny::cube_with_block(1.0, 0.6);
  scene.materials.push_back({"lamp", Reflectance(1, 0.3), RadiantExitance(1, 1.0)});
  scene.surfaces[1].material = 1;
  PredictOptions options;
  options.elements = 30;
  const Prediction matrix(scene, options);
  options.form_factors.memory_limit_bytes = 1000;
  EXPECT_THROW(Prediction(scene, options), std::length_error);
  options.find_exchange = streamed_exchange;
  options.solve.share_bands = false;
  const Prediction none(scene, options);
  ASSERT_EQ(none.outcome(), SolveOutcome::converged);
  const FormFactorSummary& factors = none.fine().form_factors;
  ASSERT_TRUE(factors.closed);
  EXPECT_GT(factors.streamed_passes, 0);
  EXPECT_EQ(none.fine().usable, matrix.fine().usable);
  EXPECT_EQ(factors.pairs_unoccluded, matrix.fine().form_factors.pairs_unoccluded);
  EXPECT_GT(factors.closure_error_max, 1e-6) << "nothing to repair";
  // Both repairs end at 1e-12 of a row, both solves at 1e-7 of the largest radiosity.
  const double bound =
      none.fine().solve.error_bound[0] + matrix.fine().solve.error_bound[0] + 1e-10;
  EXPECT_LT((none.fine().reflected - matrix.fine().reflected).cwiseAbs().maxCoeff(), bound);
  EXPECT_LT(bound, 1e-5 * matrix.fine().reflected.maxCoeff());
}

}  // namespace
}  // namespace truebox

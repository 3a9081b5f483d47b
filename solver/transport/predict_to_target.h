// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "transport/prediction.h"

namespace truebox {

/// Largest bound of a surface's mean irradiance relative to that mean, over surfaces and bands that
/// receive light: what `truebox solve` prints is good to this.
double largest_relative_bound(const Prediction& prediction);

/// One attempt on the way to a requested error.
struct TargetStep {
  std::size_t elements = 0;
  double relative_bound = 0.0;
};

struct TargetedPrediction {
  std::unique_ptr<Prediction> prediction;  ///< the last attempt
  std::vector<TargetStep> steps;
  bool is_reached = false;
};

/// Chooses grid and tolerances so that largest_relative_bound <= `relative_error`: starts coarse,
/// foretells the elements the observed bound asks for (it falls like elements^(-3/4), the gathered
/// order 1.5) and solves again until the bound is met or the form factors exceed the memory limit.
/// The target is met by the bound, not by the foretelling. `options.elements` is the first attempt.
/// Throws std::invalid_argument unless 0 < relative_error < 1; std::length_error if not even the
/// first attempt fits the memory limit.
TargetedPrediction predict_to_target(const Scene& scene, const PredictOptions& options,
                                     double relative_error);

/// The same with another way to predict with `elements` and tolerances of its options.
using Predictor = std::function<std::unique_ptr<Prediction>(const PredictOptions&)>;
TargetedPrediction predict_to_target(const PredictOptions& options, double relative_error,
                                     const Predictor& predict);

}  // namespace truebox

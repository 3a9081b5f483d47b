// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "transport/prediction.h"

namespace truebox {

/// The largest relative bound among what was asked for.
struct RelativeBound {
  double value = 0.0;     ///< share, e.g. 0.01
  double in_order = 0.0;  ///< what finer grids are foretold from: see SurfaceMeans::bound_in_order
  std::string where;      ///< "floor, 552 nm"
};

/// Of the mean irradiance of each surface, relative to that mean, over surfaces and bands that
/// receive light.
RelativeBound relative_bound_of_surfaces(const Prediction& prediction);
double largest_relative_bound(const Prediction& prediction);

/// One attempt on the way to a requested error.
struct TargetStep {
  std::size_t elements = 0;
  double relative_bound = 0.0;
  std::string where;  ///< that is
};

struct TargetedPrediction {
  std::unique_ptr<Prediction> prediction;  ///< the last attempt
  std::vector<TargetStep> steps;
  bool is_reached = false;
  /// Where memory or sense end first: elements that the target is foretold to take, and the bound
  /// foretold for `elements_that_fit` of them.
  double elements_needed = 0.0, elements_that_fit = 0.0, bound_that_fits = 0.0;
};

/// Predicts with `elements` and tolerances of its options; judges a prediction.
using Predictor = std::function<std::unique_ptr<Prediction>(const PredictOptions&)>;
using Judge = std::function<RelativeBound(const Prediction&)>;

/// Chooses grid and tolerances so that the bound that `judge` finds is at most `relative_error`.
/// The bound meets the target, not the foretelling: a coarse solve (`options.elements`, or what the
/// bound needs to be reliable) foretells the elements (the bound falls like elements^(-3/4), the
/// gathered order 1.5), and the next solve takes them, though no more than four times as many as
/// the last, so that the coarser ones cost little. The solver's share of the error is a thousandth;
/// that of form factors by exact visibility is far below the grids' in any case. What is foretold
/// to take more elements than fit `memory_limit_bytes` (without a matrix: than 200,000) is not
/// tried.
/// Throws std::invalid_argument unless 0 < relative_error < 1; std::length_error if not even the
/// first attempt fits the memory limit. Links bound nothing: they never reach it.
TargetedPrediction predict_to_target(const Scene& scene, const PredictOptions& options,
                                     double relative_error);
TargetedPrediction predict_to_target(const PredictOptions& options, double relative_error,
                                     const Predictor& predict,
                                     const Judge& judge = relative_bound_of_surfaces);

/// Elements of a uniform mesh from which on the bound is reliable, and a few more.
std::size_t least_reliable_elements(const Scene& scene);

}  // namespace truebox

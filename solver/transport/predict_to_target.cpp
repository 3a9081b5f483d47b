// SPDX-License-Identifier: BSD-3-Clause
#include "transport/predict_to_target.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "transport/grid_difference.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr double kReserve = 1.15;  // elements beyond the foretold: a miss costs another solve
constexpr double kLargestStep = 8.0;
constexpr double kSmallestStep = 1.4;

}  // namespace

double largest_relative_bound(const Prediction& prediction) {
  const BandMatrix bound = prediction.surface_irradiance_bound();
  const BandMatrix irradiance = prediction.irradiance();
  const PatchMesh& mesh = prediction.fine().mesh;
  BandMatrix mean = BandMatrix::Zero(bound.rows(), bound.cols());
  Eigen::VectorXd area = Eigen::VectorXd::Zero(bound.rows());
  for (std::size_t i = 0; i < mesh.size(); ++i) {
    if (!prediction.fine().usable[i]) continue;
    const auto surface = static_cast<Index>(mesh.surface_of(mesh.patches[i]));
    const double free_m2 = prediction.fine().free_area_m2[static_cast<Index>(i)];
    mean.row(surface) += free_m2 * irradiance.row(static_cast<Index>(i));
    area[surface] += free_m2;
  }
  double largest = 0.0;
  for (Index s = 0; s < bound.rows(); ++s) {
    if (prediction.scene().surfaces[static_cast<std::size_t>(s)].is_opening) continue;
    for (Index k = 0; k < bound.cols(); ++k)
      if (mean(s, k) > 0.0) largest = std::max(largest, bound(s, k) * area[s] / mean(s, k));
  }
  return largest;
}

TargetedPrediction predict_to_target(const Scene& scene, const PredictOptions& options,
                                     double relative_error) {
  return predict_to_target(options, relative_error, [&](const PredictOptions& attempt) {
    return std::make_unique<Prediction>(scene, attempt);
  });
}

TargetedPrediction predict_to_target(const PredictOptions& options, double relative_error,
                                     const Predictor& predict) {
  if (!(relative_error > 0.0 && relative_error < 1.0))
    throw std::invalid_argument("a target error lies between 0 and 1");
  PredictOptions attempt = options;
  attempt.solve.relative_bound =
      std::min(options.solve.relative_bound, std::max(1e-12, 1e-3 * relative_error));
  const auto largest_matrix = static_cast<std::size_t>(
      std::sqrt(static_cast<double>(options.form_factors.memory_limit_bytes) / sizeof(double)));
  TargetedPrediction result;
  while (true) {
    try {
      result.prediction = predict(attempt);
    } catch (const std::length_error&) {  // the mesh came out larger than foretold
      if (result.steps.empty()) throw;
      return result;
    }
    const std::size_t elements = result.prediction->fine().mesh.size();
    const double bound = largest_relative_bound(*result.prediction);
    result.steps.push_back({elements, bound});
    if (result.prediction->outcome() != SolveOutcome::converged) return result;
    // A bound that may not hold is no bound: the grids must be fine enough for it first.
    result.is_reached = bound <= relative_error && result.prediction->bound_is_reliable();
    if (result.is_reached) return result;
    const double wanted = kReserve * std::pow(bound / relative_error, 2.0 / kGatheredOrder);
    const double growth = std::clamp(wanted, kSmallestStep, kLargestStep);
    const double limit = static_cast<double>(largest_matrix) / static_cast<double>(elements);
    if (limit < kSmallestStep) return result;
    attempt.elements =
        static_cast<std::size_t>(static_cast<double>(attempt.elements) * std::min(growth, limit));
  }
}

}  // namespace truebox

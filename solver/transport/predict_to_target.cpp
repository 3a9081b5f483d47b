// SPDX-License-Identifier: BSD-3-Clause
#include "transport/predict_to_target.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "transport/grid_difference.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr double kReserve = 1.15;  // elements beyond the foretold: a miss costs another solve
// Edges halved once: some sixteenth of the cost is behind, and then the grids show their order.
constexpr double kLargestStep = 4.0;
constexpr double kSmallestStep = 1.5;  // bounds go up and down by a fifth from mesh to mesh
constexpr double kMostElements = 200000.0;

double elements_that_fit(const PredictOptions& options) {
  if (options.find_exchange || options.solve_grid) return kMostElements;
  return std::floor(
      std::sqrt(static_cast<double>(options.form_factors.memory_limit_bytes) / sizeof(double)));
}

double least_elements(const PatchMesh& mesh) {
  return 1.1 * Prediction::kPatchesAPiece * static_cast<double>(mesh.pieces.size());
}

// The bound falls like elements^(-3/4).
double foretold_elements(const Prediction& prediction, double bound, double target) {
  const double n = static_cast<double>(prediction.fine().mesh.size());
  const double wanted = n * std::pow(bound / target, 2.0 / kGatheredOrder);
  return prediction.bound_is_reliable() ? wanted
                                        : std::max(wanted, least_elements(prediction.fine().mesh));
}

std::string name_of_band(const Scene& scene, std::size_t band) {
  if (scene.is_total) return "all wavelengths";
  return std::to_string(std::lround(scene.bands.centre_nm(band))).append(" nm");
}

}  // namespace

RelativeBound relative_bound_of_surfaces(const Prediction& prediction) {
  const Scene& scene = prediction.scene();
  const SurfaceMeans means = prediction.surface_means();
  RelativeBound largest;
  for (Index s = 0; s < means.irradiance.rows(); ++s) {
    const Surface& surface = scene.surfaces[static_cast<std::size_t>(s)];
    if (surface.is_opening) continue;
    for (Index k = 0; k < means.irradiance.cols(); ++k) {
      const double mean = means.irradiance(s, k);
      if (!(mean > 0.0)) continue;
      largest.in_order = std::max(largest.in_order, means.bound_in_order(s, k) / mean);
      if (means.error_bound(s, k) <= largest.value * mean) continue;
      largest.value = means.error_bound(s, k) / mean;
      largest.where = surface.name + ", " + name_of_band(scene, static_cast<std::size_t>(k));
    }
  }
  return largest;
}

double largest_relative_bound(const Prediction& prediction) {
  return relative_bound_of_surfaces(prediction).value;
}

std::size_t least_reliable_elements(const Scene& scene) {
  std::size_t pieces = 0;
  for (const Surface& surface : scene.surfaces) pieces += surface.pieces.size();
  return static_cast<std::size_t>(1.1 * Prediction::kPatchesAPiece * static_cast<double>(pieces));
}

TargetedPrediction predict_to_target(const Scene& scene, const PredictOptions& options,
                                     double relative_error) {
  return predict_to_target(options, relative_error, [&](const PredictOptions& attempt) {
    return std::make_unique<Prediction>(scene, attempt);
  });
}

TargetedPrediction predict_to_target(const PredictOptions& options, double relative_error,
                                     const Predictor& predict, const Judge& judge) {
  if (!(relative_error > 0.0 && relative_error < 1.0))
    throw std::invalid_argument("a target error lies between 0 and 1");
  PredictOptions attempt = options;
  attempt.solve.relative_bound =
      std::min(options.solve.relative_bound, std::max(1e-12, 1e-3 * relative_error));
  TargetedPrediction result;
  result.elements_that_fit = elements_that_fit(options);
  while (true) {
    try {
      result.prediction = predict(attempt);
    } catch (const std::length_error&) {  // the mesh came out larger than foretold
      if (result.steps.empty()) throw;
      return result;
    }
    const Prediction& prediction = *result.prediction;
    const double elements = static_cast<double>(prediction.fine().mesh.size());
    const RelativeBound bound = judge(prediction);
    result.steps.push_back({prediction.fine().mesh.size(), bound.value, bound.where});
    if (prediction.outcome() != SolveOutcome::converged) return result;
    // A bound that may not hold is no bound: the grids must be fine enough for it first.
    result.is_reached = bound.value <= relative_error && prediction.bound_is_reliable();
    if (result.is_reached || prediction.fine().links) return result;
    // Refused is only what is out of reach even if the grids converge as they should.
    const double fits = result.elements_that_fit;
    result.elements_needed = foretold_elements(prediction, bound.in_order, relative_error);
    result.bound_that_fits = bound.in_order * std::pow(elements / fits, 0.5 * kGatheredOrder);
    if (result.elements_needed > fits || kSmallestStep * elements > fits) return result;
    const double wanted = kReserve * foretold_elements(prediction, bound.value, relative_error);
    const double next =
        std::min(std::clamp(wanted, kSmallestStep * elements, kLargestStep * elements), fits);
    attempt.elements =
        static_cast<std::size_t>(static_cast<double>(attempt.elements) * next / elements);
  }
}

}  // namespace truebox

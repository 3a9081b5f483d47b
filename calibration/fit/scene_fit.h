// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "fit/fit_summary.h"
#include "fit/scene_fit_problem.h"
#include "radiometry/estimate.h"
#include "uncertainty/uncertainty_budget.h"

namespace truebox {

/// What one iteration had reached.
struct FitStep {
  int iteration = 0;
  double chi2 = 0.0;
  double step = 0.0;      ///< length of the last step, in units of each parameter's size
  double gradient = 0.0;  ///< largest component, scaled likewise
};

struct SceneFitOptions {
  int max_iterations = 100;
  /// Readings farther out than this many sigma count less, as 1 / |z| (Huber 1964); 0: least
  /// squares.
  double robust_sigma = 0.0;
  /// Where parameters begin, by name, instead of where the problem has them.
  std::map<std::string, double> start;
  /// Told each step; true stops with the best so far (outcome not_converged).
  std::function<bool(const FitStep&)> on_step;
};

/// A progress callback may throw it: what is at work ends, and a fit that has begun ends with the
/// best so far.
struct FitStopped {};

struct FittedParameter {
  std::string name, kind;
  std::string unit;  ///< empty: 1
  double start = 0.0;
  Estimate estimate;  ///< u is 0 and means nothing where `at_bound` or not `determined`
  bool at_bound = false;
  bool at_initial_value = false;  ///< the data did not move it, to 1e-9 of its size
  bool determined = true;         ///< false: in a null direction
  std::string note;               ///< what a reader must know about it; may be empty
  UncertaintyBudget budget;       ///< in quadrature the uncertainty
};

/// A fitted spectrum, one estimate a band.
struct FittedSpectrum {
  std::size_t material = 0;
  std::vector<Estimate> reflectance;
  std::vector<char> at_bound;
};

/// One reading with what the model made of it.
struct FittedReading {
  std::size_t plane = 0, block = 0;
  double value = 0.0, predicted = 0.0;
  double standard_uncertainty = 0.0;  ///< of the reading and its region's common error together
  double weight = 1.0;                ///< below 1: an outlier to the robust loss
  double z() const { return (value - predicted) / standard_uncertainty; }
};

struct SceneFit {
  FitSummary summary;
  std::vector<FittedParameter> parameters;
  Eigen::MatrixXd covariance;  ///< of the parameters; 0 where no uncertainty is claimed
  Eigen::MatrixXd correlation;
  std::vector<std::string> null_directions;  ///< in words
  std::string weakest_direction;             ///< the least determined combination, in words
  double birge = 1.0;  ///< factor by which chi2/nu above chance enlarged the readings' share of u
  double log_likelihood_chi2 = 0.0;  ///< chi2 of readings and priors, for information criteria
  double effective_readings = 0.0;   ///< of what is common to a region, counted as sum 1/(1+(n-1)r)
  std::vector<FitStep> history;
  std::vector<FittedSpectrum> spectra;
  std::vector<FittedReading> readings;
  SceneState state;  ///< with the estimates
  bool stopped = false;
  /// What GlossLobe leaves out, largest share of a reading: the mirror image of lit walls, k times
  /// the mean light that they send. 0 without gloss.
  double gloss_left_out = 0.0;
  std::size_t outliers = 0;

  /// Every number a person should see, in lines.
  std::string full() const;
};

/// Weighted least squares with the joint covariance C of the readings,
///   min (y - f(x))^T C^-1 (y - f(x)) + priors,     0 <= rho < 1,
/// by Levenberg-Marquardt (Ceres); C holds each reading's own u and what its region shares; what a
/// plane shares (exposure) is its gain. The uncertainties come from the singular values of the
/// whitened Jacobian with parameters at a bound left out; where chi2/nu is above what chance
/// explains (1 %) the readings' share is enlarged by its root (Birge 1932).
/// Rank deficient: the directions are named, parameters in them get no uncertainty.
SceneFit fit_scene(const SceneFitProblem& problem, const SceneFitOptions& options);

/// Largest difference of the analytic derivatives of the predicted readings from central
/// differences, relative to the largest of their column, at x = start + offset. For tests.
double largest_scene_jacobian_error(const SceneFitProblem& problem, double offset);

/// The readings that a state of the scene gives with gains at their values: what a camera without
/// noise would deliver to this problem. In the order of planes and readings.
std::vector<double> predicted_readings(const SceneFitProblem& problem);

}  // namespace truebox

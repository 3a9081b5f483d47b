// SPDX-License-Identifier: BSD-3-Clause
#include "fit/scene_fit.h"

#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "fit/scene_fit_summary.h"
#include "fit/scene_fit_uncertainty.h"
#include "fit/whitened_problem.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr int kReweightings = 4;  // later ones were seen to move nothing by 0.1 u

/// All residuals as one: their errors are joint, and one solve serves them all.
class SceneCost : public ceres::CostFunction {
 public:
  explicit SceneCost(const WhitenedProblem& problem) : problem_(problem) {
    set_num_residuals(static_cast<int>(problem.rows()));
    mutable_parameter_block_sizes()->push_back(
        static_cast<int>(problem.forward().parameters().size()));
  }

  bool Evaluate(double const* const* p, double* residuals, double** jacobians) const override {
    const Index count = static_cast<Index>(problem_.forward().parameters().size());
    const Eigen::VectorXd x = Eigen::Map<const Eigen::VectorXd>(p[0], count);
    Eigen::VectorXd residual;
    Eigen::MatrixXd jacobian;
    const bool wanted = jacobians && jacobians[0];
    if (!problem_.evaluate(x, residual, wanted ? &jacobian : nullptr)) return false;
    Eigen::Map<Eigen::VectorXd>(residuals, residual.size()) = residual;
    if (wanted) Eigen::Map<BandMatrix>(jacobians[0], jacobian.rows(), jacobian.cols()) = jacobian;
    return residual.allFinite();
  }

 private:
  const WhitenedProblem& problem_;
};

class StepRecorder : public ceres::IterationCallback {
 public:
  StepRecorder(const SceneFitOptions& options, SceneFit& fit) : options_(options), fit_(fit) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& s) override {
    const FitStep step{static_cast<int>(fit_.history.size()), 2.0 * s.cost, s.step_norm,
                       s.gradient_max_norm};
    fit_.history.push_back(step);
    if (!options_.on_step || !options_.on_step(step)) return ceres::SOLVER_CONTINUE;
    fit_.stopped = true;
    return ceres::SOLVER_TERMINATE_SUCCESSFULLY;
  }

 private:
  const SceneFitOptions& options_;
  SceneFit& fit_;
};

/// Minimises from x; the outcome goes into the summary.
void minimise(const WhitenedProblem& whitened, const SceneFitOptions& options, Eigen::VectorXd& x,
              SceneFit& fit) {
  if (x.size() == 0) {
    fit.summary.outcome = Outcome::converged;
    return;
  }
  ceres::Problem problem;
  problem.AddResidualBlock(new SceneCost(whitened), nullptr, x.data());
  const auto& parameters = whitened.forward().parameters();
  for (int k = 0; k < static_cast<int>(parameters.size()); ++k) {
    problem.SetParameterLowerBound(x.data(), k, parameters[static_cast<std::size_t>(k)].low);
    problem.SetParameterUpperBound(x.data(), k, parameters[static_cast<std::size_t>(k)].high);
  }
  StepRecorder recorder(options, fit);
  ceres::Solver::Options how;
  how.linear_solver_type = ceres::DENSE_QR;
  how.max_num_iterations = options.max_iterations;
  how.function_tolerance = 1e-10;  // of chi2: 1e4 readings are then good to 1e-3 u
  how.parameter_tolerance = 1e-10;
  how.gradient_tolerance = 1e-12;
  how.logging_type = ceres::SILENT;
  how.update_state_every_iteration = true;
  how.callbacks.push_back(&recorder);
  ceres::Solver::Summary summary;
  ceres::Solve(how, &problem, &summary);
  fit.summary.iterations += static_cast<int>(summary.iterations.size());
  fit.summary.outcome = summary.termination_type == ceres::CONVERGENCE ||
                                (summary.termination_type == ceres::USER_SUCCESS && !fit.stopped)
                            ? Outcome::converged
                            : Outcome::not_converged;
  fit.summary.message = fit.stopped ? "stopped by the user: the best so far"
                        : fit.summary.outcome == Outcome::converged ? ""
                                                                    : summary.message;
}

/// Indirect light over pi is the mean radiance that surfaces see: as if a lobe saw the same.
double gloss_left_out(const SceneFitProblem& problem, const SceneState& state) {
  if (!(state.gloss.maxCoeff() > 0.0)) return 0.0;
  const SceneModel& model = *problem.model;
  SceneState diffuse = state;
  diffuse.gloss.setZero();
  SceneState direct = diffuse;
  direct.interreflection = false;
  const BandMatrix indirect =
      model.radiosity(diffuse, nullptr).value - model.radiosity(direct, nullptr).value;
  const BandMatrix all = model.radiosity(state, nullptr).value;
  double largest = 0.0;
  for (const PlaneReadings& plane : problem.planes)
    for (const BlockReading& r : plane.readings) {
      const auto i = static_cast<Index>(r.block);
      const std::size_t material = model.scene().surfaces[model.blocks()[r.block].surface].material;
      const Eigen::VectorXd rho = state.reflectance.row(static_cast<Index>(material)).transpose();
      const double seen = indirect.row(i).dot(plane.band_weights.cwiseQuotient(rho.cwiseMax(1e-6)));
      const double sent = all.row(i).dot(plane.band_weights);
      if (sent > 0.0)
        largest = std::max(largest, state.gloss[static_cast<Index>(material)] * seen / sent);
    }
  return largest;
}

}  // namespace

SceneFit fit_scene(const SceneFitProblem& problem, const SceneFitOptions& options) {
  SceneFit fit;
  fit.summary.message = problem.invalid();
  if (!fit.summary.message.empty()) {
    fit.summary.outcome = Outcome::invalid_problem;
    return fit;
  }
  WhitenedProblem whitened(problem);
  Eigen::VectorXd x = whitened.forward().start();
  const auto& known = whitened.forward().parameters();
  for (std::size_t k = 0; k < known.size(); ++k)
    if (const auto at = options.start.find(known[k].name.name); at != options.start.end())
      x[static_cast<Index>(k)] = std::clamp(at->second, known[k].low, known[k].high);
  minimise(whitened, options, x, fit);
  for (int k = 0; options.robust_sigma > 0.0 && k < kReweightings && !fit.stopped; ++k) {
    Eigen::VectorXd predicted;
    if (!whitened.forward().predict(x, predicted, nullptr) ||
        !whitened.reweight(predicted, options.robust_sigma))
      break;
    minimise(whitened, options, x, fit);
  }
  fit.state = whitened.forward().state_of(x);
  fill_uncertainties(whitened, x, fit);
  fill_spectra(problem, whitened.forward(), fit);
  std::size_t row = 0;
  for (std::size_t k = 0; k < problem.planes.size() && row < fit.readings.size(); ++k)
    for (const BlockReading& r : problem.planes[k].readings) {
      fit.readings[row].plane = k;
      fit.readings[row].block = r.block;
      fit.outliers += fit.readings[row].weight < 0.5;
      ++row;
    }
  fit.gloss_left_out = gloss_left_out(problem, fit.state);
  add_notes(problem, fit);
  return fit;
}

double largest_scene_jacobian_error(const SceneFitProblem& problem, double offset) {
  const SceneForward forward(problem);
  Eigen::VectorXd x = forward.start();
  for (Index k = 0; k < x.size(); ++k)
    x[k] += offset * forward.parameters()[static_cast<std::size_t>(k)].size;
  Eigen::VectorXd y, low, high;
  Eigen::MatrixXd analytic;
  forward.predict(x, y, &analytic);
  double worst = 0.0;
  for (Index k = 0; k < x.size(); ++k) {
    const double step = 1e-4 * forward.parameters()[static_cast<std::size_t>(k)].size;
    Eigen::VectorXd moved = x;
    moved[k] += step;
    forward.predict(moved, high, nullptr);
    moved[k] -= 2.0 * step;
    forward.predict(moved, low, nullptr);
    const Eigen::VectorXd numeric = (high - low) / (2.0 * step);
    const double scale = std::max(1e-300, numeric.cwiseAbs().maxCoeff());
    worst = std::max(worst, (analytic.col(k) - numeric).cwiseAbs().maxCoeff() / scale);
  }
  return worst;
}

std::vector<double> predicted_readings(const SceneFitProblem& problem) {
  SceneFitProblem held = problem;
  for (PlaneReadings& plane : held.planes) plane.gain = Hold::fixed;
  const SceneForward forward(held);
  Eigen::VectorXd y;
  forward.predict(forward.start(), y, nullptr);
  return {y.data(), y.data() + y.size()};
}

}  // namespace truebox

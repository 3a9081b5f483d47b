// SPDX-License-Identifier: BSD-3-Clause
#include "fit/scene_fit.h"

#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <map>

#include "fit/joint_whitening.h"
#include "fit/scene_fit_summary.h"
#include "fit/scene_forward.h"
#include "uncertainty/distributions.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr double kBoundMargin = 1e-7;  // in units of the bounds' span or the size
constexpr int kReweightings = 4;       // later ones were seen to move nothing by 0.1 u

/// Readings with their joint covariance, priors below them: rows of unit variance.
class WhitenedProblem {
 public:
  explicit WhitenedProblem(const SceneFitProblem& problem) : problem_(problem), forward_(problem) {
    const auto n = static_cast<Index>(problem.readings());
    value_.resize(n);
    own_.resize(n);
    common_ = Eigen::VectorXd::Zero(n);
    Index row = 0;
    for (std::size_t k = 0; k < problem.planes.size(); ++k) {
      std::vector<CommonMode> of_surface(problem.model->scene().surfaces.size());
      for (const BlockReading& r : problem.planes[k].readings) {
        value_[row] = r.value;
        own_[row] = r.standard_uncertainty;
        if (problem.region_relative_u.size() > 0) {
          const std::size_t s = problem.model->blocks()[r.block].surface;
          common_[row] = problem.region_relative_u(static_cast<Index>(s), static_cast<Index>(k)) *
                         std::abs(r.value);
          of_surface[s].rows.push_back(row);
          of_surface[s].common.push_back(common_[row]);
        }
        ++row;
      }
      for (CommonMode& region : of_surface)
        if (!region.rows.empty()) regions_.push_back(std::move(region));
    }
    weight_ = Eigen::VectorXd::Ones(n);
  }

  const SceneForward& forward() const { return forward_; }
  Index rows() const { return readings() + static_cast<Index>(forward_.priors().size()); }
  Index readings() const { return value_.size(); }
  const Eigen::VectorXd& value() const { return value_; }
  const Eigen::VectorXd& own() const { return own_; }
  const Eigen::VectorXd& common() const { return common_; }
  const Eigen::VectorXd& weight() const { return weight_; }
  const std::vector<CommonMode>& regions() const { return regions_; }
  Eigen::VectorXd sigma() const { return own_.cwiseQuotient(weight_.cwiseSqrt()); }
  Eigen::VectorXd total() const {
    return (own_.array().square() + common_.array().square()).sqrt();
  }

  /// Huber's weights at the residuals; true if they still change by more than 1 %.
  bool reweight(const Eigen::VectorXd& predicted, double robust_sigma) {
    Eigen::VectorXd next(readings());
    for (Index i = 0; i < next.size(); ++i) {
      const double z = std::abs(value_[i] - predicted[i]) / total()[i];
      next[i] = z <= robust_sigma ? 1.0 : robust_sigma / z;
    }
    const double change = (next - weight_).cwiseAbs().maxCoeff();
    weight_ = next;
    return change > 0.01;
  }

  bool evaluate(const Eigen::VectorXd& x, Eigen::VectorXd& residual, Eigen::MatrixXd* jacobian,
                Eigen::VectorXd* predicted = nullptr) const {
    Eigen::VectorXd y;
    Eigen::MatrixXd d;
    if (!forward_.predict(x, y, jacobian ? &d : nullptr)) return false;
    if (predicted) *predicted = y;
    const Index n = readings();
    Eigen::MatrixXd all(n, 1 + (jacobian ? d.cols() : 0));
    all.col(0) = y - value_;
    if (jacobian) all.rightCols(d.cols()) = d;
    whiten(sigma(), regions_, all);
    residual.resize(rows());
    residual.head(n) = all.col(0);
    if (jacobian) {
      jacobian->setZero(rows(), d.cols());
      jacobian->topRows(n) = all.rightCols(d.cols());
    }
    for (Index r = n; r < rows(); ++r) {
      const PriorRow& prior = forward_.priors()[static_cast<std::size_t>(r - n)];
      residual[r] = -prior.value;
      for (const auto& [k, factor] : prior.terms) {
        residual[r] += factor * x[static_cast<Index>(k)];
        if (jacobian) (*jacobian)(r, static_cast<Index>(k)) = factor;
      }
    }
    return true;
  }

 private:
  const SceneFitProblem& problem_;
  SceneForward forward_;
  Eigen::VectorXd value_, own_, common_, weight_;
  std::vector<CommonMode> regions_;
};

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

/// Columns of parameters that are not at a bound.
struct Inner {
  std::vector<Index> columns;
  Eigen::MatrixXd jacobian;
  Eigen::VectorXd size;
  std::vector<ParameterName> names;
};

Inner inner_of(const SceneForward& forward, const Eigen::VectorXd& x,
               const Eigen::MatrixXd& jacobian, SceneFit& fit) {
  Inner inner;
  const auto& parameters = forward.parameters();
  for (Index k = 0; k < x.size(); ++k) {
    const SceneParameter& p = parameters[static_cast<std::size_t>(k)];
    FittedParameter fitted{.name = p.name.name,
                           .kind = p.name.kind,
                           .start = p.start,
                           .estimate = {x[k], 0.0},
                           .note = {},
                           .budget = {}};
    fitted.at_bound =
        x[k] <= p.low + kBoundMargin * p.size || x[k] >= p.high - kBoundMargin * p.size;
    fitted.at_initial_value = std::abs(x[k] - p.start) <= 1e-9 * p.size;
    if (!fitted.at_bound) {
      inner.columns.push_back(k);
      inner.names.push_back(p.name);
    }
    fit.parameters.push_back(std::move(fitted));
  }
  const auto count = static_cast<Index>(inner.columns.size());
  inner.jacobian.resize(jacobian.rows(), count);
  inner.size.resize(count);
  for (Index j = 0; j < count; ++j) {
    inner.jacobian.col(j) = jacobian.col(inner.columns[static_cast<std::size_t>(j)]);
    inner.size[j] =
        parameters[static_cast<std::size_t>(inner.columns[static_cast<std::size_t>(j)])].size;
  }
  return inner;
}

/// Splits the variance of each determined parameter: dx = C J^T (whitened errors), and the
/// whitened errors are those of readings (own, common to a region) and of priors.
void fill_budgets(const WhitenedProblem& whitened, const Inner& inner, const Identifiability& known,
                  double birge, SceneFit& fit) {
  const Index n = whitened.readings();
  // W^T W J: W = (I - a w w^T) / sigma is applied once more, from the other side.
  const Eigen::VectorXd sigma = whitened.sigma();
  Eigen::MatrixXd again = sigma.asDiagonal() * inner.jacobian.topRows(n);
  whiten(sigma, whitened.regions(), again);
  again = sigma.cwiseInverse().asDiagonal() * again;
  const Eigen::MatrixXd influence = again * known.covariance / (birge * birge);
  for (Index j = 0; j < inner.jacobian.cols(); ++j) {
    if (!known.determined[static_cast<std::size_t>(j)]) continue;
    UncertaintyBudget& budget =
        fit.parameters[static_cast<std::size_t>(inner.columns[static_cast<std::size_t>(j)])].budget;
    const double own = influence.col(j).cwiseProduct(sigma).norm();
    double shared = 0.0;
    for (const CommonMode& region : whitened.regions()) {
      double sum = 0.0;
      for (std::size_t k = 0; k < region.rows.size(); ++k)
        sum += influence(region.rows[k], j) * region.common[k];
      shared += sum * sum;
    }
    budget.add("readings", birge * own);
    if (shared > 0.0) budget.add("common to a surface (model error)", birge * std::sqrt(shared));
    std::map<std::string, double> priors;
    for (Index r = n; r < inner.jacobian.rows(); ++r) {
      const double part = inner.jacobian.row(r).dot(known.covariance.col(j));
      priors[whitened.forward().priors()[static_cast<std::size_t>(r - n)].source] += part * part;
    }
    for (const auto& [source, variance] : priors)
      if (variance > 0.0) budget.add(source, std::sqrt(variance));
  }
}

void fill_statistics(const WhitenedProblem& whitened, const Eigen::VectorXd& residual,
                     std::size_t free, SceneFit& fit) {
  const Index n = whitened.readings();
  FitSummary& s = fit.summary;
  s.observations = static_cast<std::size_t>(n);
  s.parameters = free;
  s.chi2 = residual.head(n).squaredNorm();
  s.chi2_standards = residual.tail(residual.size() - n).squaredNorm();
  fit.log_likelihood_chi2 = s.chi2 + s.chi2_standards;
  const double dof = static_cast<double>(residual.size()) - static_cast<double>(free);
  s.chi2_per_dof = dof > 0.0 ? fit.log_likelihood_chi2 / dof : 0.0;
  constexpr double kChance = 0.01;
  if (dof > 0.0 && s.chi2_per_dof > 1.0 &&
      chi_squared_upper_tail(fit.log_likelihood_chi2, dof) < kChance)
    fit.birge = std::sqrt(s.chi2_per_dof);
  double in_regions = 0.0;
  Index rows_in_regions = 0;
  for (const CommonMode& region : whitened.regions()) {
    double r = 0.0;
    const auto count = static_cast<double>(region.rows.size());
    for (std::size_t k = 0; k < region.rows.size(); ++k)
      r += std::pow(region.common[k] / whitened.total()[region.rows[k]], 2) / count;
    in_regions += count / (1.0 + (count - 1.0) * r);
    rows_in_regions += static_cast<Index>(region.rows.size());
  }
  fit.effective_readings = in_regions + static_cast<double>(n - rows_in_regions);
}

void fill_uncertainties(const WhitenedProblem& whitened, const Eigen::VectorXd& x, SceneFit& fit) {
  Eigen::VectorXd residual, predicted;
  Eigen::MatrixXd jacobian;
  if (!whitened.evaluate(x, residual, &jacobian, &predicted)) {
    fit.summary.outcome = Outcome::not_converged;
    fit.summary.message = "the radiosity solve did not converge";
    return;
  }
  Inner inner = inner_of(whitened.forward(), x, jacobian, fit);
  fill_statistics(whitened, residual, inner.columns.size(), fit);
  inner.jacobian.topRows(whitened.readings()) /= fit.birge;
  const Identifiability known = identify(inner.jacobian, inner.size);
  fit.summary.condition = known.condition;
  for (const Eigen::VectorXd& direction : known.null_directions)
    fit.null_directions.push_back(describe_direction(direction, inner.size, inner.names));
  if (!fit.null_directions.empty()) {
    fit.summary.null_direction = fit.null_directions.front();
    // A search along a valley without slope may also run out of steps.
    if (!fit.stopped) fit.summary.outcome = Outcome::rank_deficient;
  }
  fit.covariance = Eigen::MatrixXd::Zero(x.size(), x.size());
  for (std::size_t a = 0; a < inner.columns.size(); ++a) {
    FittedParameter& p = fit.parameters[static_cast<std::size_t>(inner.columns[a])];
    p.determined = known.determined[a] != 0;
    p.estimate.standard_uncertainty =
        std::sqrt(known.covariance(static_cast<Index>(a), static_cast<Index>(a)));
    for (std::size_t b = 0; b < inner.columns.size(); ++b)
      fit.covariance(inner.columns[a], inner.columns[b]) =
          known.covariance(static_cast<Index>(a), static_cast<Index>(b));
  }
  fit.correlation = correlation_of(fit.covariance);
  if (known.null_directions.empty() && !inner.columns.empty())
    fit.weakest_direction = weakest_direction(known.covariance, inner.size, inner.names);
  fill_budgets(whitened, inner, known, fit.birge, fit);

  const Eigen::VectorXd total = whitened.total();
  for (Index i = 0; i < predicted.size(); ++i)
    fit.readings.push_back({.value = whitened.value()[i],
                            .predicted = predicted[i],
                            .standard_uncertainty = total[i],
                            .weight = whitened.weight()[i]});
}

void fill_spectra(const SceneFitProblem& problem, const SceneForward& forward, SceneFit& fit) {
  for (std::size_t m = 0; m < problem.reflectances.size(); ++m) {
    const auto& map = forward.spectrum_of(m);
    if (map.basis.cols() == 0) continue;
    FittedSpectrum spectrum{m, {}, {}};
    const auto first = static_cast<Index>(map.first), count = map.basis.cols();
    const Eigen::MatrixXd c =
        map.basis * fit.covariance.block(first, first, count, count) * map.basis.transpose();
    for (Index b = 0; b < map.basis.rows(); ++b) {
      bool at_bound = false;
      for (Index k = 0; k < count; ++k)
        if (map.basis(b, k) != 0.0) {
          const FittedParameter& p = fit.parameters[map.first + static_cast<std::size_t>(k)];
          at_bound = at_bound || p.at_bound;
        }
      spectrum.reflectance.push_back(
          {fit.state.reflectance(static_cast<Index>(m), b), std::sqrt(std::max(0.0, c(b, b)))});
      spectrum.at_bound.push_back(at_bound);
    }
    fit.spectra.push_back(std::move(spectrum));
  }
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

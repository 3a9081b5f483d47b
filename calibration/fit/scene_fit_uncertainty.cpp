// SPDX-License-Identifier: BSD-3-Clause
#include "fit/scene_fit_uncertainty.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>

#include "fit/scene_fit_summary.h"
#include "uncertainty/distributions.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr double kBoundMargin = 1e-7;  // in units of the bounds' span or the size

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
                           .unit = p.unit,
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

/// Below which share of the largest a singular value is rounding: derivatives by differences have
/// 1e-8 of it where cameras move, and where surfaces do what form factors are good to.
double rank_tolerance(const std::vector<SceneParameter>& parameters) {
  double tolerance = 1e-8;
  for (const SceneParameter& p : parameters)
    tolerance =
        std::max(tolerance, p.name.kind == "geometry offsets"                              ? 1e-4
                            : p.name.kind == "poses" || p.name.kind == "lens coefficients" ? 1e-6
                                                                                           : 0.0);
  return tolerance;
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

}  // namespace

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
  const Identifiability known =
      identify(inner.jacobian, inner.size, rank_tolerance(whitened.forward().parameters()));
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

}  // namespace truebox

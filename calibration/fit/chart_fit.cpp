// SPDX-License-Identifier: BSD-3-Clause
#include "fit/chart_fit.h"

#include <ceres/ceres.h>
#include <ceres/gradient_checker.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <sstream>

namespace truebox {
namespace {

constexpr double kRankTolerance = 1e-12;  // smallest over largest eigenvalue, columns scaled to 1

/// (g (rho + s) (1 + terms . c) - value) / sigma; parameter blocks rho, g, s, then c.
class BlockCost : public ceres::CostFunction {
 public:
  BlockCost(const PatchBlock& block, int order)
      : value_(block.value),
        sigma_(block.standard_uncertainty),
        terms_(field_terms(order, block.x, block.y)) {
    set_num_residuals(1);
    *mutable_parameter_block_sizes() = {1, 1, 1};
    if (!terms_.empty())
      mutable_parameter_block_sizes()->push_back(static_cast<int>(terms_.size()));
  }

  bool Evaluate(double const* const* p, double* residuals, double** jacobians) const override {
    const double rho = p[0][0] + p[2][0], gain = p[1][0];
    double field = 1.0;
    for (std::size_t i = 0; i < terms_.size(); ++i) field += terms_[i] * p[3][i];
    residuals[0] = (gain * rho * field - value_) / sigma_;
    if (!jacobians) return true;
    if (jacobians[0]) jacobians[0][0] = gain * field / sigma_;
    if (jacobians[1]) jacobians[1][0] = rho * field / sigma_;
    if (jacobians[2]) jacobians[2][0] = gain * field / sigma_;
    if (!terms_.empty() && jacobians[3])
      for (std::size_t i = 0; i < terms_.size(); ++i)
        jacobians[3][i] = gain * rho * terms_[i] / sigma_;
    return true;
  }

 private:
  double value_, sigma_;
  std::vector<double> terms_;
};

/// (rho - known) / u.
class StandardCost : public ceres::SizedCostFunction<1, 1> {
 public:
  explicit StandardCost(Estimate known) : known_(known) {}
  bool Evaluate(double const* const* p, double* residuals, double** jacobians) const override {
    residuals[0] = (p[0][0] - known_.value) / known_.standard_uncertainty;
    if (jacobians && jacobians[0]) jacobians[0][0] = 1.0 / known_.standard_uncertainty;
    return true;
  }

 private:
  Estimate known_;
};

/// Parameters in one place; the signal is divided by `scale`, so that the gain is near 1.
struct Parameters {
  double scale = 1.0;
  std::vector<double> rho;
  double gain = 1.0, veil = 0.0;
  std::vector<double> field;

  std::vector<double*> blocks_of(std::size_t patch) {
    std::vector<double*> blocks{&rho[patch], &gain, &veil};
    if (!field.empty()) blocks.push_back(field.data());
    return blocks;
  }
};

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

Parameters starting_point(const ChartProblem& problem, int order) {
  Parameters start;
  std::vector<double> ratios, values;
  for (const PatchBlock& b : problem.blocks) {
    values.push_back(b.value);
    if (const auto& known = problem.standards[b.patch]; known && known->value > 0.0)
      ratios.push_back(b.value / known->value);
  }
  const double signal = ratios.empty() ? 2.0 * median(values) : median(ratios);
  start.scale = std::abs(signal) > 0.0 ? std::abs(signal) : 1.0;
  start.field.assign(field_terms(order, 0.0, 0.0).size(), 0.0);
  std::vector<double> sum(problem.patches.size(), 0.0), count(sum.size(), 0.0);
  for (const PatchBlock& b : problem.blocks) {
    sum[b.patch] += b.value / start.scale;
    count[b.patch] += 1.0;
  }
  for (std::size_t p = 0; p < sum.size(); ++p)
    start.rho.push_back(problem.standards[p] ? problem.standards[p]->value
                                             : std::max(sum[p] / count[p], 1e-3));
  return start;
}

PatchBlock scaled(PatchBlock block, double scale) {
  block.value /= scale;
  block.standard_uncertainty /= scale;
  return block;
}

void add_residuals(const ChartProblem& problem, const ChartFitOptions& options, Parameters& at,
                   ceres::Problem& ceres_problem) {
  for (const PatchBlock& b : problem.blocks)
    ceres_problem.AddResidualBlock(new BlockCost(scaled(b, at.scale), options.field_order), nullptr,
                                   at.blocks_of(b.patch));
  for (std::size_t p = 0; p < problem.standards.size(); ++p) {
    if (problem.standards[p])
      ceres_problem.AddResidualBlock(new StandardCost(*problem.standards[p]), nullptr, &at.rho[p]);
    ceres_problem.SetParameterLowerBound(&at.rho[p], 0, 0.0);
  }
  if (!options.fit_veil) ceres_problem.SetParameterBlockConstant(&at.veil);
}

/// The free parameters, in the order of the dense Jacobian's columns.
struct Free {
  std::vector<double*> blocks;
  std::vector<std::string> names;  ///< one a column
};

Free free_parameters(const ChartProblem& problem, const ChartFitOptions& options, Parameters& at) {
  Free free;
  for (std::size_t p = 0; p < at.rho.size(); ++p) {
    if (at.rho[p] <= 0.0) continue;  // at its bound: held there
    free.blocks.push_back(&at.rho[p]);
    free.names.push_back("reflectance " + problem.patches[p]);
  }
  free.blocks.push_back(&at.gain);
  free.names.push_back("gain");
  if (options.fit_veil) {
    free.blocks.push_back(&at.veil);
    free.names.push_back("veil");
  }
  if (!at.field.empty()) {
    free.blocks.push_back(at.field.data());
    for (std::size_t i = 0; i < at.field.size(); ++i)
      free.names.push_back("illumination term " + std::to_string(i + 1));
  }
  return free;
}

Eigen::MatrixXd jacobian(ceres::Problem& problem, const Free& free,
                         std::vector<double>& residuals) {
  ceres::Problem::EvaluateOptions options;
  options.parameter_blocks = free.blocks;
  ceres::CRSMatrix sparse;
  problem.Evaluate(options, nullptr, &residuals, nullptr, &sparse);
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(sparse.num_rows, sparse.num_cols);
  for (int r = 0; r < sparse.num_rows; ++r)
    for (int k = sparse.rows[static_cast<std::size_t>(r)];
         k < sparse.rows[static_cast<std::size_t>(r) + 1]; ++k)
      dense(r, sparse.cols[static_cast<std::size_t>(k)]) =
          sparse.values[static_cast<std::size_t>(k)];
  return dense;
}

std::string described_direction(const Eigen::VectorXd& direction, const Free& free) {
  std::vector<int> order(static_cast<std::size_t>(direction.size()));
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<int>(i);
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return std::abs(direction[a]) > std::abs(direction[b]); });
  std::ostringstream text;
  const std::size_t shown = std::min<std::size_t>(4, order.size());
  for (std::size_t i = 0; i < shown; ++i)
    text << (i ? ", " : "") << (direction[order[i]] < 0 ? "-" : "+")
         << free.names[static_cast<std::size_t>(order[i])];
  if (order.size() > shown) text << ", ...";
  return text.str();
}

/// Covariance of the free parameters, or the null direction in the summary.
Eigen::MatrixXd covariance(const Eigen::MatrixXd& j, const Free& free, FitSummary& summary) {
  const Eigen::VectorXd norms = j.colwise().norm().cwiseMax(1e-300);
  const Eigen::MatrixXd scaled_j = j * norms.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scaled_j.transpose() * scaled_j);
  const Eigen::VectorXd& values = eigen.eigenvalues();
  const double smallest = values[0], largest = values[values.size() - 1];
  summary.condition = smallest > 0.0 ? largest / smallest : std::numeric_limits<double>::infinity();
  if (!(smallest > kRankTolerance * largest)) {
    summary.outcome = Outcome::rank_deficient;
    const Eigen::VectorXd direction =
        norms.cwiseInverse().asDiagonal() * eigen.eigenvectors().col(0);
    summary.null_direction = described_direction(direction, free);
    return {};
  }
  const Eigen::MatrixXd scaled_inverse =
      eigen.eigenvectors() * values.cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose();
  return norms.cwiseInverse().asDiagonal() * scaled_inverse * norms.cwiseInverse().asDiagonal();
}

void fill_uncertainties(const ChartProblem& problem, const ChartFitOptions& options, Parameters& at,
                        ceres::Problem& ceres_problem, ChartFit& fit) {
  const Free free = free_parameters(problem, options, at);
  std::vector<double> residuals;
  Eigen::MatrixXd j = jacobian(ceres_problem, free, residuals);
  FitSummary& summary = fit.summary;
  summary.parameters = free.names.size();
  const std::size_t blocks = problem.blocks.size();
  for (std::size_t i = 0; i < residuals.size(); ++i)
    (i < blocks ? summary.chi2 : summary.chi2_standards) += residuals[i] * residuals[i];
  std::size_t standards = residuals.size() - blocks;
  const double dof =
      static_cast<double>(blocks + standards) - static_cast<double>(free.names.size());
  summary.chi2_per_dof = dof > 0.0 ? (summary.chi2 + summary.chi2_standards) / dof : 0.0;
  const double birge = std::sqrt(std::max(1.0, summary.chi2_per_dof));
  j.topRows(static_cast<Eigen::Index>(blocks)) /= birge;
  const Eigen::MatrixXd c = covariance(j, free, summary);
  if (summary.outcome == Outcome::rank_deficient) return;
  Eigen::Index column = 0;
  for (std::size_t p = 0; p < at.rho.size(); ++p)
    if (at.rho[p] > 0.0) {
      fit.reflectance[p].standard_uncertainty = std::sqrt(c(column, column));
      ++column;
    }
  if (options.fit_veil) fit.veil.standard_uncertainty = std::sqrt(c(column + 1, column + 1));
}

}  // namespace

ChartFit fit_chart(const ChartProblem& problem, const ChartFitOptions& options) {
  ChartFit fit;
  fit.field_order = options.field_order;
  if (const auto why = options.invalid(problem)) {
    fit.summary.outcome = Outcome::invalid_problem;
    fit.summary.message = *why;
    return fit;
  }
  Parameters at = starting_point(problem, options.field_order);
  ceres::Problem ceres_problem;
  add_residuals(problem, options, at, ceres_problem);
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  solver.max_num_iterations = options.max_iterations;
  solver.function_tolerance = 1e-16;
  solver.gradient_tolerance = 1e-12;
  solver.parameter_tolerance = 1e-12;
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary report;
  ceres::Solve(solver, &ceres_problem, &report);

  FitSummary& summary = fit.summary;
  summary.iterations = static_cast<int>(report.iterations.size());
  summary.observations = static_cast<std::size_t>(report.num_residuals);
  summary.outcome =
      report.termination_type == ceres::CONVERGENCE ? Outcome::converged : Outcome::not_converged;
  if (!summary.usable()) summary.message = report.message;
  for (double rho : at.rho) {
    fit.reflectance.push_back({rho, 0.0});
    fit.at_bound.push_back(rho <= 0.0);
  }
  fit.gain = at.gain * at.scale;
  fit.veil = {at.veil, 0.0};
  fit.field = at.field;
  fill_uncertainties(problem, options, at, ceres_problem, fit);
  return fit;
}

double largest_jacobian_error(const ChartProblem& problem, const ChartFitOptions& options) {
  Parameters at = starting_point(problem, options.field_order);
  for (std::size_t i = 0; i < at.field.size(); ++i) at.field[i] = 0.01 * static_cast<double>(i + 1);
  at.veil = 0.02;
  double largest = 0.0;
  for (const PatchBlock& b : problem.blocks) {
    const BlockCost cost(scaled(b, at.scale), options.field_order);
    const std::vector<const ceres::Manifold*>* flat = nullptr;
    const ceres::GradientChecker checker(&cost, flat, ceres::NumericDiffOptions{});
    ceres::GradientChecker::ProbeResults results;
    checker.Probe(at.blocks_of(b.patch).data(), 1e-9, &results);
    largest = std::max(largest, results.maximum_relative_error);
  }
  return largest;
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "fit/whitened_problem.h"

#include <cmath>

namespace truebox {

using Eigen::Index;

WhitenedProblem::WhitenedProblem(const SceneFitProblem& problem)
    : problem_(problem), forward_(problem) {
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

bool WhitenedProblem::reweight(const Eigen::VectorXd& predicted, double robust_sigma) {
  Eigen::VectorXd next(readings());
  for (Index i = 0; i < next.size(); ++i) {
    const double z = std::abs(value_[i] - predicted[i]) / total()[i];
    next[i] = z <= robust_sigma ? 1.0 : robust_sigma / z;
  }
  const double change = (next - weight_).cwiseAbs().maxCoeff();
  weight_ = next;
  return change > 0.01;
}

bool WhitenedProblem::evaluate(const Eigen::VectorXd& x, Eigen::VectorXd& residual,
                               Eigen::MatrixXd* jacobian, Eigen::VectorXd* predicted) const {
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

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "fit/identifiability.h"

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <map>
#include <set>

namespace truebox {

using Eigen::Index;

Identifiability identify(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& size_of,
                         double rank_tolerance) {
  const Index p = jacobian.cols();
  Identifiability result;
  result.determined.assign(static_cast<std::size_t>(p), 1);
  result.covariance = Eigen::MatrixXd::Zero(p, p);
  if (p == 0) return result;
  constexpr double kMovesNothing = 1e-9;
  Eigen::VectorXd inverse_norm(p);
  Eigen::MatrixXd scaled = jacobian;
  for (Index k = 0; k < p; ++k) {
    const double norm = jacobian.col(k).norm();
    const bool is_zero = !(norm * size_of[k] > kMovesNothing);
    inverse_norm[k] = is_zero ? size_of[k] : 1.0 / norm;
    if (is_zero)
      scaled.col(k).setZero();
    else
      scaled.col(k) /= norm;
  }
  Eigen::MatrixXd triangle = Eigen::MatrixXd::Zero(p, p);
  const Index rows = std::min(p, scaled.rows());
  triangle.topRows(rows) = Eigen::HouseholderQR<Eigen::MatrixXd>(scaled)
                               .matrixQR()
                               .topRows(rows)
                               .triangularView<Eigen::Upper>();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(triangle, Eigen::ComputeFullV);
  const Eigen::VectorXd& s = svd.singularValues();
  const double ratio = s[p - 1] / s[0];
  result.condition = ratio > 0.0 ? 1.0 / (ratio * ratio) : std::numeric_limits<double>::infinity();
  for (Index k = 0; k < p; ++k) {
    const Eigen::VectorXd direction = svd.matrixV().col(k);
    if (s[k] > rank_tolerance * s[0]) {
      const Eigen::VectorXd step = direction.cwiseProduct(inverse_norm) / s[k];
      result.covariance += step * step.transpose();
      continue;
    }
    result.null_directions.push_back(direction.cwiseProduct(inverse_norm));
    constexpr double kShare = 1e-4;
    for (Index i = 0; i < p; ++i)
      if (std::abs(direction[i]) > kShare) result.determined[static_cast<std::size_t>(i)] = 0;
  }
  for (Index i = 0; i < p; ++i)
    if (!result.determined[static_cast<std::size_t>(i)]) {
      result.covariance.row(i).setZero();
      result.covariance.col(i).setZero();
    }
  return result;
}

namespace {

std::string joined(const std::vector<std::string>& items) {
  std::string text;
  for (std::size_t i = 0; i < items.size(); ++i)
    text += (i == 0 ? "" : i + 1 == items.size() ? " and " : ", ") + items[i];
  return text;
}

/// "all reflectances" where every item of a kind is there, else the items.
std::vector<std::string> in_words(const std::set<std::string>& items,
                                  const std::vector<ParameterName>& names) {
  std::map<std::string, std::set<std::string>> of_kind;
  for (const ParameterName& n : names) of_kind[n.kind].insert(n.item);
  std::vector<std::string> words;
  for (const auto& [kind, all] : of_kind) {
    std::vector<std::string> here;
    for (const std::string& item : all)
      if (items.contains(item)) here.push_back(item);
    if (here.size() == all.size() && all.size() > 1)
      words.push_back("all " + kind);
    else
      words.insert(words.end(), here.begin(), here.end());
  }
  return words;
}

}  // namespace

std::string describe_direction(const Eigen::VectorXd& direction, const Eigen::VectorXd& size_of,
                               const std::vector<ParameterName>& names) {
  constexpr double kShown = 0.2;
  const Eigen::VectorXd share = direction.cwiseQuotient(size_of);
  const double largest = share.cwiseAbs().maxCoeff();
  std::set<std::string> up, down;
  for (Index i = 0; i < share.size(); ++i)
    if (std::abs(share[i]) > kShown * largest)
      (share[i] > 0.0 ? up : down).insert(names[static_cast<std::size_t>(i)].item);
  // A sign is arbitrary: the side that has emission or more items comes first.
  if (down.size() > up.size()) std::swap(up, down);
  const auto first = in_words(up, names), second = in_words(down, names);
  if (second.empty()) return joined(first) + (first.size() > 1 || up.size() > 1 ? " together" : "");
  return joined(first) + " against " + joined(second);
}

Eigen::MatrixXd correlation_of(const Eigen::MatrixXd& covariance) {
  Eigen::MatrixXd r = Eigen::MatrixXd::Zero(covariance.rows(), covariance.cols());
  for (Index i = 0; i < r.rows(); ++i)
    for (Index j = 0; j < r.cols(); ++j) {
      const double product = covariance(i, i) * covariance(j, j);
      if (product > 0.0) r(i, j) = covariance(i, j) / std::sqrt(product);
    }
  return r;
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "alignment/normal_matrix.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numeric>

namespace truebox {
namespace {

std::string described(const Eigen::VectorXd& direction, const std::vector<std::string>& names) {
  std::vector<std::size_t> order(names.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto weight = [&](std::size_t i) {
    return std::abs(direction[static_cast<Eigen::Index>(i)]);
  };
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return weight(a) > weight(b); });
  std::string text;
  for (std::size_t k = 0; k < std::min<std::size_t>(order.size(), 4); ++k) {
    if (weight(order[k]) < 0.1 * weight(order[0])) break;
    char term[32];
    std::snprintf(term, sizeof term, "%+.2f ", direction[static_cast<Eigen::Index>(order[k])]);
    text += (k > 0 ? " " : "") + std::string(term) + names[order[k]];
  }
  return text;
}

}  // namespace

NormalInverse invert_normal_matrix(const Eigen::MatrixXd& normal,
                                   const std::vector<std::string>& names, double rank_tolerance) {
  NormalInverse result;
  result.condition = std::numeric_limits<double>::infinity();
  const Eigen::VectorXd norms = normal.diagonal().cwiseMax(0.0).cwiseSqrt();
  Eigen::Index empty = 0;
  if (!(norms.minCoeff(&empty) > 0.0)) {
    result.weakest = "+1.00 " + names[static_cast<std::size_t>(empty)];
    return result;
  }
  const Eigen::VectorXd scale = norms.cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scale.asDiagonal() * normal *
                                                             scale.asDiagonal());
  const Eigen::VectorXd& values = eigen.eigenvalues();
  // In column-scaled coordinates, so that a term's weight is its share and not its unit's.
  result.weakest = described(eigen.eigenvectors().col(0), names);
  if (!(values[0] > rank_tolerance * values[values.size() - 1])) return result;
  result.condition = values[values.size() - 1] / values[0];
  const Eigen::MatrixXd scaled =
      eigen.eigenvectors() * values.cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose();
  result.inverse = scale.asDiagonal() * scaled * scale.asDiagonal();
  return result;
}

}  // namespace truebox

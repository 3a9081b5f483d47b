// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace truebox {

/// What a parameter is called, alone and as one of a kind.
struct ParameterName {
  std::string name;  ///< "reflectance white, 550 nm"
  std::string item;  ///< "reflectance of white"
  std::string kind;  ///< "reflectances"
};

/// What the data say about parameters, from the whitened Jacobian (rows of unit variance, priors
/// included).
struct Identifiability {
  Eigen::MatrixXd covariance;    ///< of what is determined; rows of what is not are 0
  std::vector<char> determined;  ///< 0: part of a null direction
  double condition = 0.0;        ///< of the column-scaled Jacobian, squared
  std::vector<Eigen::VectorXd> null_directions;
};

/// Covariance (J^T J)^-1 by singular values of J with columns scaled to 1. A direction whose
/// singular value is below `rank_tolerance` of the largest is null: the parameters in it are not
/// determined, and no pseudo-inverse pretends that they were. `size_of` is what counts as a large
/// change of each parameter: a column that moves no reading by 1e-9 of its sigma counts as zero.
/// Ceres' own covariance does the opposite: see its header on null_space_rank.
Identifiability identify(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& size_of,
                         double rank_tolerance = 1e-8);

/// "emission scale against all gains", "reflectances of red and green together": the parameters
/// with more than a fifth of the largest share, each share in units of size_of.
std::string describe_direction(const Eigen::VectorXd& direction, const Eigen::VectorXd& size_of,
                               const std::vector<ParameterName>& names);

/// r_ij = C_ij / sqrt(C_ii C_jj); 0 where a variance is.
Eigen::MatrixXd correlation_of(const Eigen::MatrixXd& covariance);

}  // namespace truebox

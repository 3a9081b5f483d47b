// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace truebox {

/// Inverse of a normal matrix J^T J, found from its eigenvalues after its columns are scaled to 1,
/// so that units do not matter. Empty where the smallest eigenvalue is below `rank_tolerance` of
/// the largest.
struct NormalInverse {
  std::optional<Eigen::MatrixXd> inverse;
  double condition = 0.0;  ///< largest over smallest eigenvalue, columns scaled
  std::string weakest;     ///< the least determined combination, by its largest terms
};
NormalInverse invert_normal_matrix(const Eigen::MatrixXd& normal,
                                   const std::vector<std::string>& names,
                                   double rank_tolerance = 1e-13);

}  // namespace truebox

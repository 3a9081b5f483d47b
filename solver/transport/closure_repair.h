// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

namespace truebox {

enum class ClosureRepair {
  none,
  scaling,        ///< S_ij <- x_i x_j S_ij: symmetric, stays non-negative (Sinkhorn & Knopp 1967)
  least_squares,  ///< least sum of (change / S_ij)^2: S_ij <- S_ij (1 + S_ij (l_i + l_j))
};

/// What was repaired, and by how much.
struct ClosureReport {
  ClosureRepair method = ClosureRepair::none;
  std::size_t entries = 0;        ///< that were allowed to change: pairs, not their mirror images
  double change_max = 0.0;        ///< relative
  double change_rms = 0.0;        ///< relative, over the entries
  double error_before_rms = 0.0;  ///< |sum_j F_ij - 1|, area-weighted over the rows that count
  double error_before_max = 0.0;
  double error_after_max = 0.0;
  std::size_t negative = 0;         ///< entries that came out below 0 and were set to 0
  std::size_t rows_left_alone = 0;  ///< too little of them may change
  int sweeps = 0;

  /// One line for a person.
  std::string brief() const;
};

/// Changes the entries S(j, i), j in `entries[i]` > i, and their mirror images, of a symmetric
/// matrix of exchange areas until each row sums to its area, m^2. For sampled entries of a closed
/// scene only: rows that are wrong for another reason (a biased visibility, a leak) would be
/// bent to look right. Rows with usable[i] = 0, or whose entries make up less than 1e-3 of the
/// area, are left alone. Sources: Sinkhorn & Knopp (1967); Taylor & Luck (1995); Larsen & Howell
/// (1986), least squares smoothing of exchange areas.
ClosureReport repair_closure(Eigen::MatrixXd& exchange_area_m2, const Eigen::VectorXd& area_m2,
                             const std::vector<char>& usable,
                             const std::vector<std::vector<std::uint32_t>>& entries,
                             ClosureRepair method);

}  // namespace truebox

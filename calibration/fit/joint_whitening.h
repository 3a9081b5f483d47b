// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

namespace truebox {

/// Readings of one region whose errors move together: C = diag(sigma^2) + c c^T.
struct CommonMode {
  std::vector<Eigen::Index> rows;
  std::vector<double> common;  ///< c, one a row: standard uncertainty of the shared error
};

/// Multiplies rows by W with W^T W = C^-1: afterwards they are independent with unit variance.
/// With y = r / sigma, w = c / sigma:  W r = y - a w (w^T y),  a = (1 - 1 / sqrt(1 + w^2)) / w^2.
/// `sigma` one a row, above 0; no row may be in two regions.
/// Source: Sherman & Morrison (1950), for the symmetric root of I + w w^T.
void whiten(const Eigen::VectorXd& sigma, const std::vector<CommonMode>& regions,
            Eigen::Ref<Eigen::MatrixXd> rows);

}  // namespace truebox

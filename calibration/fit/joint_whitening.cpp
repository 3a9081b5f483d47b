// SPDX-License-Identifier: BSD-3-Clause
#include "fit/joint_whitening.h"

#include <cmath>

namespace truebox {

using Eigen::Index;

void whiten(const Eigen::VectorXd& sigma, const std::vector<CommonMode>& regions,
            Eigen::Ref<Eigen::MatrixXd> rows) {
  rows.array().colwise() /= sigma.array();
  for (const CommonMode& region : regions) {
    double square = 0.0;
    Eigen::RowVectorXd product = Eigen::RowVectorXd::Zero(rows.cols());
    for (std::size_t k = 0; k < region.rows.size(); ++k) {
      const double w = region.common[k] / sigma[region.rows[k]];
      square += w * w;
      product += w * rows.row(region.rows[k]);
    }
    if (!(square > 0.0)) continue;
    const double a = (1.0 - 1.0 / std::sqrt(1.0 + square)) / square;
    for (std::size_t k = 0; k < region.rows.size(); ++k)
      rows.row(region.rows[k]) -= a * region.common[k] / sigma[region.rows[k]] * product;
  }
}

}  // namespace truebox

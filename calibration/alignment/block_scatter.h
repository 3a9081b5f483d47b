// SPDX-License-Identifier: BSD-3-Clause
// How a robust fit scatters whose residuals are alike in whole areas. Internal to this folder.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "alignment/radiance_fit.h"

namespace truebox {

/// Sums over the pixels of one square: robust scores and curvatures of camera (first) and gains.
struct ScoreBlock {
  Eigen::VectorXd score;
  Eigen::MatrixXd curvature;
};

struct BlockScatter {
  int block_px = 0;  ///< of the photograph's planes
  std::size_t blocks = 0;
  Eigen::MatrixXd covariance;         ///< of all parameters, from the radiances' errors
  Eigen::MatrixXd inverse_curvature;  ///< of edges and radiances together
  Eigen::MatrixXd information;        ///< of the camera from radiances as weighted, gains free
  double dispersion = 1.0;            ///< mean variance over that of independent pixels
};

/// Jackknife over squares: C = (G - 1) / G sum_g d_g d_g^T, d_g = (H - H_g)^-1 s_g, H = known
/// information + radiances' curvature / dispersion. The square's side is doubled from 8 px while at
/// least 40 squares have pixels; of those sides the smallest is taken that comes within a tenth of
/// the largest dispersion.
BlockScatter block_scatter(const std::vector<RadianceRow>& rows,
                           const std::vector<RadianceSample>& samples, std::size_t groups,
                           const Eigen::MatrixXd& known_information, double dispersion);

}  // namespace truebox

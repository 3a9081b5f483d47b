// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

namespace truebox {

/// What edges are off by beyond their pixels' noise, px: each piece on its own, and in waves that
/// go along an edge (boards that are bent, shading, a lens of another kind).
/// Covariance of two pieces of one edge: wave^2 exp(-distance / wave length); of two edges: none.
struct EdgeErrors {
  double white_u_px = 0.0;
  double wave_u_px = 0.0;
  double wave_length_px = 0.0;  ///< distance at which the correlation has fallen to 1/e
};

/// The observations of one edge, in their order along it, linearised in n parameters.
struct EdgeChain {
  Eigen::MatrixXd rows;         ///< pieces x n: d residual / d parameter, px a unit
  Eigen::VectorXd residual_px;  ///< at the solution
  Eigen::VectorXd noise_u_px;   ///< of the piece's own pixels
  Eigen::VectorXd u_px;         ///< that it was given in the fit
  Eigen::VectorXd gap_px;       ///< in the picture to the piece before
};

/// A fit near its solution. Priors and picked points, independent of the edges, as the quadratic
/// form d^T information d + 2 pull^T d + constant in the parameters' change d.
struct LinearisedFit {
  std::vector<EdgeChain> edges;
  Eigen::MatrixXd information;
  Eigen::VectorXd pull;
};

/// What the residuals tell of the errors: models with their probabilities.
///
/// Residuals are smaller and less correlated than errors, since the fit follows what goes along an
/// edge. The likelihood of what no parameter can follow (restricted maximum likelihood: Patterson,
/// Thompson 1971, Biometrika 58(3), eq. 5; Harville 1974, Biometrika 61(2)) is free of that:
///   -2 ln L = ln det S + ln det(J^T S^-1 J + P) + min_d (r + J d)^T S^-1 (r + J d) + ...
/// S^-1 by Kalman's filter along each edge (an Ornstein-Uhlenbeck process plus white noise), which
/// costs a step a piece. Evaluated on a grid of the white share and the wave length, and over the
/// size at each by quadrature, with a flat prior of the size's logarithm and as much for waves as
/// for none: few and correlated residuals leave wide posteriors, and their mean covariance is wider
/// than that of the likeliest model, as Student's distribution is wider than the normal one.
struct WeightedErrors {
  EdgeErrors errors;
  double probability = 0.0;
};
std::vector<WeightedErrors> edge_error_posterior(const LinearisedFit& fit);

/// The root mean square sizes and the mean logarithmic length of a posterior.
EdgeErrors mean_errors(const std::vector<WeightedErrors>& posterior);

/// sum over edges of J^T W S W J, W = diag(u^-2): how a weighted fit scatters under these errors.
Eigen::MatrixXd edge_scatter(const LinearisedFit& fit, const EdgeErrors& errors);

}  // namespace truebox

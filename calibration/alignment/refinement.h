// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <limits>
#include <string>
#include <vector>

#include "alignment/alignment_summary.h"
#include "alignment/camera_parameters.h"
#include "alignment/edge_errors.h"

namespace truebox {

/// A point of an edge was seen on a line in the picture: only the distance across the edge counts.
struct EdgeObservation {
  std::size_t edge = 0;  ///< observations of one edge follow one another along it
  Vec3 point_m = Vec3::Zero();
  PixelPosition position;
  std::array<double, 2> normal{};
  double u_px = 1.0;        ///< that the fit weighs it with
  double noise_u_px = 0.0;  ///< the part of it that comes from the piece's own pixels
};

/// A point of the scene was seen at a place in the picture.
struct PointObservation {
  std::string name;
  Vec3 point_m = Vec3::Zero();
  PixelPosition position;
  double u_px = 1.0;
};

struct Observations {
  std::vector<EdgeObservation> edges;
  std::vector<PointObservation> points;
};

/// Which parameters are estimated, and what is known of them beforehand (normal distributions; an
/// infinite u: nothing). Priors instead of bounds: a bound that is active would make the covariance
/// meaningless.
struct ParameterFreedom {
  ParameterFreedom() { prior_u.fill(std::numeric_limits<double>::infinity()); }
  std::array<bool, kCameraParameters> free{};
  std::array<double, kCameraParameters> prior_value{};
  std::array<double, kCameraParameters> prior_u;

  std::vector<std::size_t> indices() const;  ///< of the free ones
};

struct RefinementOptions {
  ParameterFreedom freedom;
  double cauchy_width =
      0.0;  ///< in units of u where residuals begin to count less; 0: least squares
  int max_iterations = 50;
};

struct Refinement {
  bool converged = false;
  std::string message;
  CameraParameters parameters;
};

/// Minimises sum (n . (projection - position) / u)^2 over edges, sum |projection - position|^2 /
/// u^2 over points, and the priors. Levenberg-Marquardt (Ceres), Cauchy's loss on the observations.
Refinement refine(const CameraParameters& start, const Observations& observations,
                  const RefinementOptions& options);

/// n . (projection - position) of each edge observation, px; NaN behind the camera.
std::vector<double> edge_residuals_px(const CameraParameters& parameters,
                                      const std::vector<EdgeObservation>& edges);

/// Covariance of the free parameters, in the order of freedom.indices(), at the least-squares
/// solution, C = H^-1 (J^T W S W J + P) H^-1, H = J^T W J + P: J the residuals' derivatives, W the
/// weights u^-2 of the fit, P the priors, and S the covariance of the edges' errors, which the
/// residuals tell (a "sandwich": White 1980, Econometrica 48(4)): the pixels' noise and
/// `edge_error_posterior`, over which S is averaged. u only weighs; u_px of points counts as it is.
struct ParameterCovariance {
  AlignmentOutcome outcome = AlignmentOutcome::not_run;
  std::string null_direction;
  Eigen::MatrixXd covariance;
  double condition = 0.0;
  EdgeErrors errors;  ///< beyond the pixels' noise, mean
};
ParameterCovariance parameter_covariance(const CameraParameters& parameters,
                                         const Observations& observations,
                                         const ParameterFreedom& freedom);

/// Standard deviation (px) that all observations share beyond their own u, so that the mean of
/// r^2 / (u^2 + x^2) is 1; 0 if it already is at most that. Source: Mandel, Paule (1970), Anal.
/// Chem. 42(11). `degrees` are those of freedom.
double excess_u_px(const std::vector<double>& residuals_px, const std::vector<double>& u_px,
                   double degrees);

}  // namespace truebox

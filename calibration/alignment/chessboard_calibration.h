// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "alignment/alignment_summary.h"
#include "image/image.h"
#include "scene/camera_description.h"

namespace truebox {

struct Chessboard {
  int columns = 9, rows = 6;  ///< of inner corners
  double square_m = 0.025;
};

/// The corners of one photograph, row by row.
struct ChessboardView {
  std::string name;
  std::vector<PixelPosition> corners;
};

/// One view of the board: X_camera = exp(rotation) X + translation, the board's first corner at
/// the origin, x along a row, y along a column.
struct BoardPose {
  std::array<double, 3> rotation_rad{}, translation_m{};
  double rms_px = 0.0;  ///< distance of seen and projected corners
};

struct LensCalibration {
  AlignmentOutcome outcome = AlignmentOutcome::not_run;
  std::string message;
  std::string null_direction;  ///< the least determined combination of parameters
  double focal_px = 0.0;
  std::array<double, 2> principal_point_px{};
  LensDistortion distortion;
  std::vector<EstimatedParameter> estimated;  ///< focal length, principal point, k1 k2 p1 p2 k3
  Eigen::MatrixXd covariance;                 ///< of `estimated`
  std::vector<BoardPose> views;
  double rms_px = 0.0;       ///< distance of seen and projected corners, as OpenCV counts it
  double corner_u_px = 0.0;  ///< of one coordinate of a corner, from the residuals
  double condition = 0.0;
};

/// One focal length, principal point and distortion k1 k2 p1 p2 k3 from several views of a flat
/// board (Zhang 2000, IEEE PAMI 22(11)), all reprojection errors at once by least squares (Ceres),
/// no priors. The covariance is (J^T J)^-1 s^2, s^2 = sum r^2 / (2 n - parameters): corner errors
/// are taken as independent and alike. A board that is not flat is not in it.
/// `rank_deficient` with the direction named where the views do not determine the lens: one view,
/// or all parallel to the film (focal length against distance); counted as such is a focal length
/// that is uncertain by over 5 %, or a principal point by over 10 % of the width.
/// `invalid_problem`: a view with another number of corners than the board.
LensCalibration calibrate_lens(const Chessboard& board, int width_px, int height_px,
                               const std::vector<ChessboardView>& views);

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "alignment/chessboard_calibration.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>

#include "alignment/normal_matrix.h"
#include "alignment/projection.h"

namespace truebox {
namespace {

constexpr int kLens = 8;  // focal length, principal point, k1 k2 p1 p2 k3
constexpr std::array<const char*, kLens> kNames = {
    "focal length", "principal point x", "principal point y", "k1", "k2", "p1", "p2", "k3"};
constexpr std::array<const char*, 6> kPoseNames = {
    "rotation x", "rotation y", "rotation z", "translation x", "translation y", "translation z"};

Vec3 board_point(const Chessboard& board, std::size_t corner) {
  const auto columns = static_cast<std::size_t>(board.columns);
  return board.square_m * Vec3(double(corner % columns), double(corner / columns), 0.0);
}

struct CornerCost {
  Vec3 point_m;
  PixelPosition seen;

  template <class T>
  bool operator()(const T* lens, const T* pose, T* residual) const {
    const T x[3] = {T(point_m[0]), T(point_m[1]), T(point_m[2])};
    T in_camera[3], px[2];
    rotate(pose, x, in_camera);
    for (int k = 0; k < 3; ++k) in_camera[k] += pose[3 + k];
    T distortion[12];
    for (int k = 0; k < 12; ++k) distortion[k] = k < 5 ? lens[3 + k] : T(0.0);
    if (!film_position(in_camera, lens, T(1.0), distortion, px)) return false;
    residual[0] = px[0] - seen.x_px;
    residual[1] = px[1] - seen.y_px;
    return true;
  }
};
using CornerCostFunction = ceres::AutoDiffCostFunction<CornerCost, 2, kLens, 6>;

struct Unknowns {
  std::array<double, kLens> lens{};
  std::vector<std::array<double, 6>> poses;
};

/// Zhang's closed form where it exists, else a common lens; poses by the homographies.
Unknowns starting_point(const Chessboard& board, int width_px, int height_px,
                        const std::vector<ChessboardView>& views) {
  std::vector<std::vector<cv::Point3f>> objects;
  std::vector<std::vector<cv::Point2f>> images;
  for (const ChessboardView& view : views) {
    auto& object = objects.emplace_back();
    auto& image = images.emplace_back();
    for (std::size_t i = 0; i < view.corners.size(); ++i) {
      const Vec3 p = board_point(board, i);
      object.emplace_back(float(p[0]), float(p[1]), 0.0f);
      image.emplace_back(float(view.corners[i].x_px), float(view.corners[i].y_px));
    }
  }
  const double width = std::max(width_px, height_px);
  double focal = 0.0;
  try {
    focal = cv::initCameraMatrix2D(objects, images, {width_px, height_px}, 1.0).at<double>(0, 0);
  } catch (const cv::Exception&) {
  }
  if (!(focal > 0.3 * width && focal < 10.0 * width)) focal = 1.2 * width;
  Unknowns start;
  start.lens = {focal, 0.5 * width_px, 0.5 * height_px};
  const cv::Mat camera =
      (cv::Mat_<double>(3, 3) << focal, 0, 0.5 * width_px, 0, focal, 0.5 * height_px, 0, 0, 1);
  for (std::size_t v = 0; v < views.size(); ++v) {
    cv::Mat r, t;
    cv::solvePnP(objects[v], images[v], camera, cv::noArray(), r, t);
    auto& pose = start.poses.emplace_back();
    for (int k = 0; k < 3; ++k) {
      pose[static_cast<std::size_t>(k)] = r.at<double>(k);
      pose[static_cast<std::size_t>(k + 3)] = t.at<double>(k);
    }
  }
  return start;
}

/// Sum of squares and normal matrix at the solution; lens first, then six columns a view.
struct Solution {
  Eigen::MatrixXd normal;
  double sum = 0.0;
  std::vector<double> view_sums;
};

Solution evaluate(const Chessboard& board, const std::vector<ChessboardView>& views,
                  const Unknowns& at) {
  const auto n = static_cast<Eigen::Index>(kLens + 6 * views.size());
  Solution s{Eigen::MatrixXd::Zero(n, n), 0.0, {}};
  for (std::size_t v = 0; v < views.size(); ++v) {
    double sum = 0.0;
    const Eigen::Index first = kLens + 6 * static_cast<Eigen::Index>(v);
    for (std::size_t i = 0; i < views[v].corners.size(); ++i) {
      const CornerCostFunction cost(new CornerCost{board_point(board, i), views[v].corners[i]});
      const double* parameters[] = {at.lens.data(), at.poses[v].data()};
      double residual[2];
      Eigen::Matrix<double, 2, kLens, Eigen::RowMajor> by_lens;
      Eigen::Matrix<double, 2, 6, Eigen::RowMajor> by_pose;
      double* jacobians[] = {by_lens.data(), by_pose.data()};
      cost.Evaluate(parameters, residual, jacobians);
      sum += residual[0] * residual[0] + residual[1] * residual[1];
      s.normal.topLeftCorner<kLens, kLens>() += by_lens.transpose() * by_lens;
      s.normal.block<6, 6>(first, first) += by_pose.transpose() * by_pose;
      s.normal.block<kLens, 6>(0, first) += by_lens.transpose() * by_pose;
    }
    s.normal.block<6, kLens>(first, 0) = s.normal.block<kLens, 6>(0, first).transpose();
    s.view_sums.push_back(sum);
    s.sum += sum;
  }
  return s;
}

bool solve(const Chessboard& board, const std::vector<ChessboardView>& views, Unknowns& at,
           std::string& message) {
  ceres::Problem problem;
  for (std::size_t v = 0; v < views.size(); ++v)
    for (std::size_t i = 0; i < views[v].corners.size(); ++i)
      problem.AddResidualBlock(
          new CornerCostFunction(new CornerCost{board_point(board, i), views[v].corners[i]}),
          nullptr, at.lens.data(), at.poses[v].data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.max_num_iterations = 200;
  options.function_tolerance = 1e-12;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  message = summary.message;
  return summary.termination_type == ceres::CONVERGENCE;
}

void fill_estimates(const Unknowns& at, const Eigen::MatrixXd& covariance, LensCalibration& c) {
  c.covariance = covariance.topLeftCorner(kLens, kLens);
  for (std::size_t k = 0; k < kLens; ++k)
    c.estimated.push_back({kNames[k], k < 3 ? "px" : "1", at.lens[k],
                           std::sqrt(c.covariance(Eigen::Index(k), Eigen::Index(k))),
                           std::numeric_limits<double>::infinity()});
}

}  // namespace

LensCalibration calibrate_lens(const Chessboard& board, int width_px, int height_px,
                               const std::vector<ChessboardView>& views) {
  LensCalibration c;
  const auto corners = static_cast<std::size_t>(board.columns * board.rows);
  c.outcome = AlignmentOutcome::invalid_problem;
  if (views.empty()) c.message = "no photograph shows the chessboard";
  for (const ChessboardView& view : views)
    if (view.corners.size() != corners)
      c.message = view.name + " has " + std::to_string(view.corners.size()) + " corners, not " +
                  std::to_string(corners);
  if (!c.message.empty()) return c;
  Unknowns at = starting_point(board, width_px, height_px, views);
  const bool converged = solve(board, views, at, c.message);
  c.focal_px = at.lens[0];
  c.principal_point_px = {at.lens[1], at.lens[2]};
  c.distortion.k1 = at.lens[3];
  c.distortion.k2 = at.lens[4];
  c.distortion.p1 = at.lens[5];
  c.distortion.p2 = at.lens[6];
  c.distortion.k3 = at.lens[7];
  const Solution s = evaluate(board, views, at);
  const auto n = static_cast<double>(views.size() * corners);
  c.rms_px = std::sqrt(s.sum / n);
  for (std::size_t v = 0; v < views.size(); ++v)
    c.views.push_back({{at.poses[v][0], at.poses[v][1], at.poses[v][2]},
                       {at.poses[v][3], at.poses[v][4], at.poses[v][5]},
                       std::sqrt(s.view_sums[v] / double(corners))});
  const double degrees = 2.0 * n - static_cast<double>(s.normal.rows());
  const double variance = degrees > 0.0 ? s.sum / degrees : 0.0;
  c.corner_u_px = std::sqrt(variance);
  std::vector<std::string> names(kNames.begin(), kNames.end());
  for (const ChessboardView& view : views)
    for (const char* name : kPoseNames) names.push_back(view.name + " " + name);
  const NormalInverse inverse = invert_normal_matrix(s.normal, names);
  c.condition = inverse.condition;
  c.null_direction = inverse.weakest;
  bool determined = inverse.inverse.has_value() && degrees > 0.0;
  if (determined) {
    const Eigen::MatrixXd covariance = variance * *inverse.inverse;
    determined = std::sqrt(covariance(0, 0)) < 0.05 * c.focal_px &&
                 std::sqrt(covariance(1, 1)) < 0.1 * width_px &&
                 std::sqrt(covariance(2, 2)) < 0.1 * width_px;
    if (determined) fill_estimates(at, covariance, c);
  }
  if (!determined) {
    c.outcome = AlignmentOutcome::rank_deficient;
    c.message = "the views do not determine the lens: " + c.null_direction;
    return c;
  }
  c.outcome = converged ? AlignmentOutcome::converged : AlignmentOutcome::not_converged;
  if (converged) c.message.clear();
  return c;
}

}  // namespace truebox

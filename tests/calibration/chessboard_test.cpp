// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <Eigen/Dense>
#include <cmath>
#include <filesystem>
#include <opencv2/calib3d.hpp>
#include <random>

#include "alignment/chessboard_calibration.h"
#include "alignment/chessboard_corners.h"
#include "image/image_file.h"
#include "sensor/camera.h"
#include "uncertainty/distributions.h"

namespace truebox {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr int kWidth = 640, kHeight = 480;
const Chessboard kBoard{9, 6, 0.025};

/// A board seen by a known lens, the board turned about its axes; corners with normal noise.
struct Truth {
  double focal_px = 535.0;
  std::array<double, 2> principal_px = {342.0, 236.0};
  LensDistortion distortion{-0.27, -0.04, 0.0018, -0.0003, 0.24};

  ChessboardView view(const Vec3& turn_rad, const Vec3& centre_m, double noise_px,
                      std::mt19937_64& random) const {
    std::normal_distribution<double> normal;
    const Eigen::Matrix3d r =
        turn_rad.norm() > 0.0
            ? Eigen::AngleAxisd(turn_rad.norm(), turn_rad.normalized()).toRotationMatrix()
            : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
    ChessboardView view{"view", {}};
    for (int row = 0; row < kBoard.rows; ++row)
      for (int column = 0; column < kBoard.columns; ++column) {
        const Vec3 p = centre_m + r * (kBoard.square_m * Vec3(column - 4.0, row - 2.5, 0.0));
        const auto seen = distorted(distortion, NormalisedPoint{p[0] / p[2], p[1] / p[2]});
        view.corners.push_back({principal_px[0] + focal_px * seen.x + noise_px * normal(random),
                                principal_px[1] + focal_px * seen.y + noise_px * normal(random)});
      }
    return view;
  }

  std::vector<ChessboardView> views(double noise_px, std::mt19937_64& random) const {
    std::vector<ChessboardView> all;
    for (const Vec3& turn : {Vec3(0.4, 0.0, 0.0), Vec3(-0.4, 0.2, 0.1), Vec3(0.1, 0.5, -0.2),
                             Vec3(0.2, -0.5, 0.0), Vec3(-0.3, -0.3, 0.5), Vec3(0.0, 0.1, 0.0)})
      all.push_back(view(turn, {0.05 * turn[1], -0.05 * turn[0], 0.33}, noise_px, random));
    return all;
  }
};

TEST(CalibrateLens, ReproducesThePublishedCalibrationOfTheSamePhotographs) {
  std::vector<ChessboardView> views;
  for (const auto& entry :
       fs::directory_iterator(fs::path(TRUEBOX_REFERENCE_DIR) / "chessboard_opencv"))
    if (entry.path().extension() == ".jpg") {
      const auto corners = chessboard_corners(read_image(entry.path()), 9, 6);
      ASSERT_TRUE(corners) << entry.path();
      views.push_back({entry.path().stem(), *corners});
    }
  ASSERT_EQ(views.size(), 13u);
  const LensCalibration c = calibrate_lens(kBoard, kWidth, kHeight, views);
  ASSERT_EQ(c.outcome, AlignmentOutcome::converged) << c.message;
  // left_intrinsics.yml: 13 views, the same model; its pixel centres are whole numbers.
  EXPECT_LE(c.rms_px, 0.39259098975581364);
  const double published[] = {535.91573396163199,       342.28315473308373 + 0.5,
                              235.57082909788173 + 0.5, -0.26637260909660682,
                              -0.038588898922304653,    0.0017831947042852964,
                              -0.00028122100441115472,  0.23839153080878486};
  // One set of photographs: what differs is where corners were found, which moves the estimates by
  // no more than their uncertainty.
  for (std::size_t k = 0; k < 8; ++k)
    EXPECT_NEAR(c.estimated[k].value, published[k], 2.0 * c.estimated[k].standard_uncertainty)
        << c.estimated[k].name;
  RecordProperty("rms_px", std::to_string(c.rms_px));
  std::printf("rms %.4f px (published 0.3926), f %.2f +- %.2f\n", c.rms_px, c.focal_px,
              c.estimated[0].standard_uncertainty);
}

TEST(CalibrateLens, RecoversAnExactLens) {
  std::mt19937_64 random(1);
  const Truth truth;
  const LensCalibration c = calibrate_lens(kBoard, kWidth, kHeight, truth.views(0.0, random));
  ASSERT_EQ(c.outcome, AlignmentOutcome::converged) << c.message;
  EXPECT_NEAR(c.focal_px, truth.focal_px, 1e-4);
  EXPECT_NEAR(c.distortion.k1, truth.distortion.k1, 1e-6);
  EXPECT_NEAR(c.principal_point_px[0], truth.principal_px[0], 1e-4);
  EXPECT_LT(c.rms_px, 1e-6);
}

TEST(CalibrateLens, CoversTheTruthInTwoStandardUncertaintiesAsOftenAsItSays) {
  constexpr std::size_t kTrials = 200;
  constexpr double kOutside = 0.0455;  // of a normal distribution, beyond 2 sigma
  std::mt19937_64 random(7);
  const Truth truth;
  const std::array<double, 8> exact = {
      truth.focal_px,      truth.principal_px[0], truth.principal_px[1], truth.distortion.k1,
      truth.distortion.k2, truth.distortion.p1,   truth.distortion.p2,   truth.distortion.k3};
  std::array<std::size_t, 8> misses{};
  double distance = 0.0, focal_square = 0.0, focal_u = 0.0, opencv_u = 0.0, opencv_trials = 0.0;
  for (std::size_t trial = 0; trial < kTrials; ++trial) {
    const auto views = truth.views(0.2, random);
    const LensCalibration c = calibrate_lens(kBoard, kWidth, kHeight, views);
    ASSERT_EQ(c.outcome, AlignmentOutcome::converged) << c.message;
    Eigen::VectorXd error(8);
    for (std::size_t k = 0; k < 8; ++k) {
      error[Eigen::Index(k)] = c.estimated[k].value - exact[k];
      misses[k] += std::abs(error[Eigen::Index(k)]) > 2.0 * c.estimated[k].standard_uncertainty;
    }
    distance += error.dot(c.covariance.ldlt().solve(error));
    focal_square += error[0] * error[0];
    focal_u += c.estimated[0].standard_uncertainty;
    if (trial % 5 != 0) continue;
    std::vector<std::vector<cv::Point3f>> objects(views.size());
    std::vector<std::vector<cv::Point2f>> images(views.size());
    for (std::size_t v = 0; v < views.size(); ++v)
      for (int i = 0; i < 54; ++i) {
        objects[v].emplace_back(0.025f * float(i % 9), 0.025f * float(i / 9), 0.0f);
        const auto& p = views[v].corners[static_cast<std::size_t>(i)];
        images[v].emplace_back(float(p.x_px - 0.5), float(p.y_px - 0.5));
      }
    cv::Mat camera = cv::Mat::eye(3, 3, CV_64F), distortion, r, t, intrinsic_u, extrinsic_u, rms;
    cv::calibrateCamera(objects, images, {kWidth, kHeight}, camera, distortion, r, t, intrinsic_u,
                        extrinsic_u, rms, cv::CALIB_FIX_ASPECT_RATIO);
    opencv_u += intrinsic_u.at<double>(0) + intrinsic_u.at<double>(1);  // the free one of fx, fy
    opencv_trials += 1.0;
  }
  for (std::size_t k = 0; k < 8; ++k) {
    // Each tail at 1e-4: all sixteen together at 0.2 %.
    EXPECT_GT(binomial_upper_tail(misses[k], kTrials, kOutside), 1e-4) << "parameter " << k;
    EXPECT_GT(1.0 - binomial_upper_tail(misses[k] + 1, kTrials, kOutside), 1e-4)
        << "parameter " << k;
  }
  // chi^2 of 8 degrees of freedom: its mean over the trials within 4 standard deviations.
  EXPECT_NEAR(distance / kTrials, 8.0, 4.0 * std::sqrt(16.0 / kTrials));
  const double scatter = std::sqrt(focal_square / kTrials);
  std::printf("u(f) over scatter: %.3f here, %.3f OpenCV\n", focal_u / kTrials / scatter,
              opencv_u / opencv_trials / scatter);
  RecordProperty("opencv_ratio", std::to_string(opencv_u / opencv_trials / scatter));
}

TEST(CalibrateLens, OneViewNamesWhatItCannotTell) {
  std::mt19937_64 random(3);
  const Truth truth;
  const LensCalibration c = calibrate_lens(kBoard, kWidth, kHeight,
                                           {truth.view({0.1, 0.0, 0.0}, {0, 0, 0.4}, 0.2, random)});
  EXPECT_EQ(c.outcome, AlignmentOutcome::rank_deficient);
  EXPECT_THAT(c.message, HasSubstr("do not determine the lens"));
  EXPECT_TRUE(c.estimated.empty());  // no uncertainty is claimed
}

TEST(CalibrateLens, BoardsParallelToTheFilmLeaveFocalLengthAndDistanceOpen) {
  std::mt19937_64 random(4);
  const Truth truth;
  std::vector<ChessboardView> views;
  for (const double x : {-0.02, 0.0, 0.02})
    views.push_back(truth.view(Vec3::Zero(), {x, -x, 0.4}, 0.1, random));
  const LensCalibration c = calibrate_lens(kBoard, kWidth, kHeight, views);
  EXPECT_EQ(c.outcome, AlignmentOutcome::rank_deficient);
  EXPECT_THAT(c.null_direction, HasSubstr("focal length"));
  EXPECT_THAT(c.null_direction, HasSubstr("translation z"));
}

TEST(CalibrateLens, RefusesNoViewsAndLostCorners) {
  EXPECT_EQ(calibrate_lens(kBoard, kWidth, kHeight, {}).outcome, AlignmentOutcome::invalid_problem);
  std::mt19937_64 random(5);
  auto view = Truth{}.view({0.2, 0.0, 0.0}, {0, 0, 0.4}, 0.1, random);
  view.corners.pop_back();
  const LensCalibration c = calibrate_lens(kBoard, kWidth, kHeight, {view});
  EXPECT_EQ(c.outcome, AlignmentOutcome::invalid_problem);
  EXPECT_THAT(c.message, HasSubstr("53 corners, not 54"));
}

TEST(ChessboardCorners, FindsNoneWhereThereAreNone) {
  Image even(320, 240);
  even.add_channel("Y", 100.0f);
  EXPECT_FALSE(chessboard_corners(even, 9, 6));
  EXPECT_FALSE(chessboard_corners(Image(), 9, 6));
  Image tiny(3, 3);
  tiny.add_channel("Y", 1.0f);
  EXPECT_FALSE(chessboard_corners(tiny, 9, 6));
  Image noise(320, 240);
  std::mt19937_64 random(6);
  for (float& v : noise.add_channel("Y").samples) v = static_cast<float>(random() % 256);
  EXPECT_FALSE(chessboard_corners(noise, 9, 6));
}

/// A board drawn through a pinhole, each pixel the mean of its square.
TEST(ChessboardCorners, AreWithinAFewHundredthsOfAPixel) {
  Truth truth;
  truth.distortion = {};
  std::mt19937_64 random(8);
  const Vec3 turn(0.3, 0.2, 0.1), centre(0.0, 0.0, 0.4);
  const auto exact = truth.view(turn, centre, 0.0, random);
  CameraDescription description;
  description.film_m = {0.0064, 0.0048};
  description.pixels = {kWidth, kHeight};
  description.focal_length_m = truth.focal_px * 1e-5;
  description.up = -Vec3::UnitY();  // y down, as in the camera's frame
  description.lens.distortion = truth.distortion;
  description.lens.principal_point_m = {(truth.principal_px[0] - 320.0) * 1e-5,
                                        (truth.principal_px[1] - 240.0) * 1e-5};
  const Camera camera(description);
  const Eigen::Matrix3d r = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  Image image(kWidth, kHeight);
  auto& samples = image.add_channel("Y").samples;
  constexpr int kSub = 4;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      double sum = 0.0;
      for (int k = 0; k < kSub * kSub; ++k) {
        const auto ray = camera.ray({x + (k % kSub + 0.5) / kSub, y + (k / kSub + 0.5) / kSub});
        const Vec3 n = r.col(2);
        const Vec3 p = ray->direction * (centre.dot(n) / ray->direction.dot(n));
        const Vec3 on = r.transpose() * (p - centre) / kBoard.square_m;
        const int u = static_cast<int>(std::floor(on[0] + 5.0));
        const int v = static_cast<int>(std::floor(on[1] + 3.5));
        const bool board = u >= 0 && v >= 0 && u < 10 && v < 7;
        sum += board && (u + v) % 2 == 0 ? 20.0 : 200.0;
      }
      samples[image.index(x, y)] = static_cast<float>(sum / (kSub * kSub));
    }
  const auto found = chessboard_corners(image, 9, 6);
  ASSERT_TRUE(found);
  double sum = 0.0;
  for (std::size_t i = 0; i < 54; ++i) {
    // The detector may number the board from either end.
    double nearest = 1e9;
    for (const PixelPosition& p : *found)
      nearest = std::min(
          nearest, std::hypot(p.x_px - exact.corners[i].x_px, p.y_px - exact.corners[i].y_px));
    sum += nearest * nearest;
  }
  // 8 bit and 16 points a pixel leave a few hundredths; another convention would be off by 0.7.
  EXPECT_LT(std::sqrt(sum / 54.0), 0.1);
}

}  // namespace
}  // namespace truebox

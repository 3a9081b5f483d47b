// SPDX-License-Identifier: BSD-3-Clause
#include "alignment/box_alignment.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "support/edge_picture.h"

namespace truebox {
namespace {

/// Root mean square distance in the picture between where two cameras see the box's corners.
double corner_error_px(const Scene& scene, const CameraDescription& a, const CameraDescription& b) {
  double sum = 0.0, n = 0.0;
  const Camera first(a), second(b);
  for (const Surface& surface : scene.surfaces)
    for (const Vec3& v : surface.pieces[0]) {
      const auto p = first.project(v), q = second.project(v);
      if (p.outcome != LensOutcome::ok || q.outcome != LensOutcome::ok) continue;
      sum += std::pow(p.position.x_px - q.position.x_px, 2) +
             std::pow(p.position.y_px - q.position.y_px, 2);
      n += 1.0;
    }
  return std::sqrt(sum / n);
}

CameraDescription turned(CameraDescription camera, const Vec3& axis, double angle_deg) {
  const Eigen::Matrix3d r =
      Eigen::AngleAxisd(angle_deg * M_PI / 180.0, axis.normalized()).toRotationMatrix();
  camera.direction = r * camera.direction;
  camera.up = r * camera.up;
  return camera;
}

TEST(AlignBox, FindsTheCameraFromTenDegreesTenPercentAndTenPercentOff) {
  const Scene scene = test_box();
  CameraDescription truth = test_camera();
  truth.lens.distortion.k1 = -0.12;
  truth.lens.distortion.k2 = 0.05;
  const Image photo = edge_picture(scene, truth, even_shade, 0.01, 1);
  const double distance_m = 4.0;
  int seed = 0;
  for (const Vec3& axis : {Vec3(1, 0, 0), Vec3(0, -1, 0), Vec3(0, 0, 1), Vec3(-1, 1, 1)})
    for (const double sign : {-1.0, 1.0}) {
      ++seed;
      CameraDescription guess = turned(test_camera(), axis, 10.0 * sign);
      const Vec3 off = Vec3(seed % 3 - 1.0, (seed / 3) % 3 - 1.0, sign).normalized();
      guess.position_m += 0.1 * distance_m * off;
      guess.focal_length_m *= 1.0 + 0.1 * (seed % 2 ? 1.0 : -1.0);
      const BoxAlignment found = align_box(scene, guess, photo, {});
      std::printf("%d start %.1f px: %s %s end %.4f px, rms %.4f share %.2f excess %.4f cv %.4f\n", seed,
                  corner_error_px(scene, truth, guess), to_string(found.outcome).c_str(),
                  found.message.c_str(), corner_error_px(scene, truth, found.camera),
                  found.rms_px, found.matched_share, found.excess_u_px, found.cross_validated_rms_px);
      EXPECT_EQ(found.outcome, AlignmentOutcome::converged);
      EXPECT_LT(corner_error_px(scene, truth, found.camera), 0.1);
    }
}

}  // namespace
}  // namespace truebox

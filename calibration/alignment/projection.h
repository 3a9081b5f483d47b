// SPDX-License-Identifier: BSD-3-Clause
// The camera of CameraParameters for any number type. Internal to this folder.
#pragma once

#include <cmath>

#include "alignment/camera_parameters.h"
#include "sensor/lens.h"

namespace truebox {

constexpr int kPose = 6, kIntrinsics = 3, kDistortion = 12, kStretch = 3;

/// A part of the parameters that an optimiser holds as one: where, and which of all it begins with.
struct Block {
  double* values;
  int first, size;
};

inline std::array<Block, 4> blocks_of(CameraParameters& p) {
  return {Block{p.pose.data(), 0, kPose}, Block{p.intrinsics.data(), kPose, kIntrinsics},
          Block{p.distortion.data(), kPose + kIntrinsics, kDistortion},
          Block{p.stretch.data(), kPose + kIntrinsics + kDistortion, kStretch}};
}

/// What does not change while parameters do.
struct Frame {
  Eigen::Matrix3d rotation;
  double aspect;
  Vec3 offset_m;
};

inline Frame frame_of(const CameraParameters& p, const Vec3& point_m) {
  return {p.rotation, p.aspect, point_m - p.centre_m};
}

/// exp(w) x, w a rotation vector (Rodrigues); to first order where the angle vanishes, so that its
/// derivative is exact there.
template <class T>
void rotate(const T* w, const T* x, T* rotated) {
  using std::cos, std::sin, std::sqrt;
  const T cross[3] = {w[1] * x[2] - w[2] * x[1], w[2] * x[0] - w[0] * x[2],
                      w[0] * x[1] - w[1] * x[0]};
  const T squared = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
  if (!(squared > 1e-24)) {
    for (int k = 0; k < 3; ++k) rotated[k] = x[k] + cross[k];
    return;
  }
  const T angle = sqrt(squared), c = cos(angle), s = sin(angle) / angle;
  const T along = (w[0] * x[0] + w[1] * x[1] + w[2] * x[2]) * (1.0 - c) / squared;
  for (int k = 0; k < 3; ++k) rotated[k] = c * x[k] + s * cross[k] + along * w[k];
}

template <class T>
LensDistortionOf<T> distortion_of(const T* d) {
  return {d[0], d[1], d[2], d[3], d[4], d[5], d[6], d[7], d[8], d[9], d[10], d[11]};
}

/// px of a point in the camera's frame; false behind the camera.
template <class T>
bool film_position(const T* in_camera, const T* intrinsics, const T& aspect, const T* distortion,
                   T* position_px) {
  if (!(in_camera[2] > T(1e-9))) return false;
  const NormalisedPointOf<T> seen =
      distorted(distortion_of(distortion),
                NormalisedPointOf<T>{in_camera[0] / in_camera[2], in_camera[1] / in_camera[2]});
  position_px[0] = intrinsics[1] + intrinsics[0] * seen.x;
  position_px[1] = intrinsics[2] + intrinsics[0] * aspect * seen.y;
  return true;
}

/// px of a point at `offset_m` from the centre, world axes; see CameraParameters.
template <class T>
bool project_point(const Eigen::Matrix3d& rotation, double aspect, const Vec3& offset_m,
                   const T* pose, const T* intrinsics, const T* distortion, const T* stretch,
                   T* position_px) {
  T turned[3], in_camera[3];
  for (int k = 0; k < 3; ++k)
    turned[k] = rotation(k, 0) * offset_m[0] * stretch[0] +
                rotation(k, 1) * offset_m[1] * stretch[1] +
                rotation(k, 2) * offset_m[2] * stretch[2];
  rotate(pose, turned, in_camera);
  for (int k = 0; k < 3; ++k) in_camera[k] += pose[3 + k];
  return film_position(in_camera, intrinsics, T(aspect), distortion, position_px);
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "image/image.h"
#include "scene/camera_description.h"

namespace truebox {

/// A camera and the box before it as the numbers that an alignment estimates.
///   X_camera = exp(w) R S (X - centre) + t,   S = diag(stretch)
/// `pose` is (w, t) with w in rad about the camera's axes (right, down, forward) and t in m: where
/// the box's centre stands in the camera's frame. About the centre, rotation and translation are
/// least correlated.
struct CameraParameters {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< R, before w
  Vec3 centre_m = Vec3::Zero();                            ///< world
  std::array<double, 6> pose{};
  std::array<double, 3> intrinsics{};   ///< focal length (of x), principal point x and y; px
  double aspect = 1.0;                  ///< focal length of y over that of x, never estimated
  std::array<double, 12> distortion{};  ///< k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 (OpenCV's order)
  std::array<double, 3> stretch = {1.0, 1.0, 1.0};  ///< of the scene along its axes
};

constexpr std::size_t kCameraParameters = 24;  ///< pose, intrinsics, distortion, stretch

/// "rotation x", ..., "focal length", "principal point x", "k1", ..., "stretch z".
const std::array<std::string, kCameraParameters>& parameter_names();

/// rad, m, px, 1.
const std::array<std::string, kCameraParameters>& parameter_units();

/// All of them, in the order of their names.
std::array<double, kCameraParameters> values_of(const CameraParameters& parameters);

CameraParameters camera_parameters(const CameraDescription& camera, const Vec3& centre_m);

/// The same camera as a scene file describes it; film, pixels and all that is not geometry from
/// `like`.
CameraDescription camera_description(const CameraParameters& parameters,
                                     const CameraDescription& like);

/// [R t] of the world as the scene file has it (stretch left out), row by row, m.
std::array<std::array<double, 4>, 3> camera_from_world(const CameraParameters& parameters);

Vec3 stretched(const CameraParameters& parameters, const Vec3& point_m);

/// Where a point of the (stretched) scene appears; nothing behind the camera. The bare lens
/// formula, without the check for folding.
std::optional<PixelPosition> projected(const CameraParameters& parameters, const Vec3& point_m);

/// The [cameras.NAME] block of a scene file in that file's unit of length.
std::string camera_toml(const CameraDescription& camera, const std::string& name,
                        double metres_per_unit);

}  // namespace truebox

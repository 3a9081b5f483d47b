// SPDX-License-Identifier: BSD-3-Clause
#include "alignment/camera_parameters.h"

#include <algorithm>
#include <cstdio>

#include "alignment/projection.h"

namespace truebox {
namespace {

Eigen::Matrix3d full_rotation(const CameraParameters& p) {
  Eigen::Matrix3d r;
  for (int column = 0; column < 3; ++column) {
    const Vec3 x = p.rotation.col(column);
    Vec3 turned;
    rotate(p.pose.data(), x.data(), turned.data());
    r.col(column) = turned;
  }
  return r;
}

std::string number(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.12g", value);
  return text;
}

std::string vector(const Vec3& v) {
  return "[" + number(v[0]) + ", " + number(v[1]) + ", " + number(v[2]) + "]";
}

}  // namespace

const std::array<std::string, kCameraParameters>& parameter_names() {
  static const std::array<std::string, kCameraParameters> kNames = {"rotation x",
                                                                    "rotation y",
                                                                    "rotation z",
                                                                    "translation x",
                                                                    "translation y",
                                                                    "translation z",
                                                                    "focal length",
                                                                    "principal point x",
                                                                    "principal point y",
                                                                    "k1",
                                                                    "k2",
                                                                    "p1",
                                                                    "p2",
                                                                    "k3",
                                                                    "k4",
                                                                    "k5",
                                                                    "k6",
                                                                    "s1",
                                                                    "s2",
                                                                    "s3",
                                                                    "s4",
                                                                    "stretch x",
                                                                    "stretch y",
                                                                    "stretch z"};
  return kNames;
}

const std::array<std::string, kCameraParameters>& parameter_units() {
  static const std::array<std::string, kCameraParameters> kUnits = {
      "rad", "rad", "rad", "m", "m", "m", "px", "px", "px", "1", "1", "1",
      "1",   "1",   "1",   "1", "1", "1", "1",  "1",  "1",  "1", "1", "1"};
  return kUnits;
}

std::array<double, kCameraParameters> values_of(const CameraParameters& p) {
  std::array<double, kCameraParameters> values{};
  auto next = std::copy(p.pose.begin(), p.pose.end(), values.begin());
  next = std::copy(p.intrinsics.begin(), p.intrinsics.end(), next);
  next = std::copy(p.distortion.begin(), p.distortion.end(), next);
  std::copy(p.stretch.begin(), p.stretch.end(), next);
  return values;
}

CameraParameters camera_parameters(const CameraDescription& camera, const Vec3& centre_m) {
  CameraParameters p;
  const Vec3 forward = camera.direction.normalized();
  const Vec3 right = camera.direction.cross(camera.up).normalized();
  p.rotation.row(0) = right;
  p.rotation.row(1) = forward.cross(right);
  p.rotation.row(2) = forward;
  p.centre_m = centre_m;
  const Vec3 t = p.rotation * (centre_m - camera.position_m);
  p.pose = {0.0, 0.0, 0.0, t[0], t[1], t[2]};
  const auto pitch = camera.pixel_pitch_m();
  p.intrinsics = {camera.focal_length_m / pitch[0],
                  0.5 * camera.pixels[0] + camera.lens.principal_point_m[0] / pitch[0],
                  0.5 * camera.pixels[1] + camera.lens.principal_point_m[1] / pitch[1]};
  p.aspect = pitch[0] / pitch[1];
  const LensDistortion& d = camera.lens.distortion;
  p.distortion = {d.k1, d.k2, d.p1, d.p2, d.k3, d.k4, d.k5, d.k6, d.s1, d.s2, d.s3, d.s4};
  return p;
}

CameraDescription camera_description(const CameraParameters& p, const CameraDescription& like) {
  CameraDescription camera = like;
  const Eigen::Matrix3d r = full_rotation(p);
  camera.direction = r.row(2);
  camera.up = -r.row(1);
  camera.position_m = p.centre_m - r.transpose() * Vec3(p.pose[3], p.pose[4], p.pose[5]);
  const auto pitch = camera.pixel_pitch_m();
  camera.focal_length_m = p.intrinsics[0] * pitch[0];
  for (std::size_t k = 0; k < 2; ++k)
    camera.lens.principal_point_m[k] = (p.intrinsics[1 + k] - 0.5 * camera.pixels[k]) * pitch[k];
  camera.lens.distortion = distortion_of(p.distortion.data());
  return camera;
}

std::array<std::array<double, 4>, 3> camera_from_world(const CameraParameters& p) {
  const Eigen::Matrix3d r = full_rotation(p);
  const Vec3 t = Vec3(p.pose[3], p.pose[4], p.pose[5]) - r * p.centre_m;
  std::array<std::array<double, 4>, 3> rows{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    rows[i] = {r(k, 0), r(k, 1), r(k, 2), t[k]};
  }
  return rows;
}

Vec3 stretched(const CameraParameters& p, const Vec3& point_m) {
  return p.centre_m +
         Vec3(p.stretch[0], p.stretch[1], p.stretch[2]).cwiseProduct(point_m - p.centre_m);
}

std::optional<PixelPosition> projected(const CameraParameters& p, const Vec3& point_m) {
  double px[2];
  if (!project_point(p.rotation, p.aspect, point_m - p.centre_m, p.pose.data(), p.intrinsics.data(),
                     p.distortion.data(), p.stretch.data(), px))
    return std::nullopt;
  return PixelPosition{px[0], px[1]};
}

std::string camera_toml(const CameraDescription& camera, const std::string& name,
                        double metres_per_unit) {
  const auto pitch = camera.pixel_pitch_m();
  const LensDescription& lens = camera.lens;
  std::string text = "[cameras." + name + "]\n";
  text += "position = " + vector(camera.position_m / metres_per_unit) + "\n";
  text += "direction = " + vector(camera.direction) + "\n";
  text += "up = " + vector(camera.up) + "\n";
  text += "focal_length_mm = " + number(1e3 * camera.focal_length_m) + "\n";
  text += "film_mm = [" + number(1e3 * camera.film_m[0]) + ", " + number(1e3 * camera.film_m[1]) +
          "]\n";
  text += "pixels = [" + std::to_string(camera.pixels[0]) + ", " +
          std::to_string(camera.pixels[1]) + "]\n\n";
  text += "[cameras." + name + ".lens]\n";
  text += "principal_point_px = [" +
          number(0.5 * camera.pixels[0] + lens.principal_point_m[0] / pitch[0]) + ", " +
          number(0.5 * camera.pixels[1] + lens.principal_point_m[1] / pitch[1]) + "]\n";
  const CameraParameters p = camera_parameters(camera, camera.position_m);
  std::string terms;
  for (std::size_t k = 0; k < p.distortion.size(); ++k)
    if (p.distortion[k] != 0.0)
      terms +=
          (terms.empty() ? "" : ", ") + parameter_names()[9 + k] + " = " + number(p.distortion[k]);
  if (!terms.empty()) text += "distortion = { " + terms + " }\n";
  return text;
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "sensor/camera.h"

namespace truebox {

Camera::Camera(const CameraDescription& d)
    : pixels_(d.pixels),
      lens_(d.lens.distortion),
      position_m_(d.position_m),
      right_(d.direction.cross(d.up).normalized()),
      down_(d.direction.normalized().cross(right_)),
      forward_(d.direction.normalized()) {
  const auto pitch_m = d.pixel_pitch_m();
  for (std::size_t k = 0; k < 2; ++k) {
    focal_px_[k] = d.focal_length_m / pitch_m[k];
    principal_point_px_[k] = 0.5 * d.pixels[k] + d.lens.principal_point_m[k] / pitch_m[k];
  }
}

NormalisedPoint Camera::normalised(PixelPosition p) const {
  return {(p.x_px - principal_point_px_[0]) / focal_px_[0],
          (p.y_px - principal_point_px_[1]) / focal_px_[1]};
}

PixelPosition Camera::pixel_position(const NormalisedPoint& image) const {
  return {principal_point_px_[0] + focal_px_[0] * image.x,
          principal_point_px_[1] + focal_px_[1] * image.y};
}

std::optional<Ray> Camera::ray(PixelPosition position) const {
  const Lens::Result seen = lens_.undistort(normalised(position));
  if (seen.outcome != LensOutcome::ok) return std::nullopt;
  const Vec3 direction = forward_ + seen.point.x * right_ + seen.point.y * down_;
  return Ray{position_m_, direction.normalized()};
}

Vec3 Camera::camera_from_world(const Vec3& point_m) const {
  const Vec3 offset = point_m - position_m_;
  return {right_.dot(offset), down_.dot(offset), forward_.dot(offset)};
}

Camera::Projection Camera::project(const Vec3& point_m) const {
  const Vec3 p = camera_from_world(point_m);
  if (!(p.z() > 0.0)) return {LensOutcome::behind_camera, {}};
  const Lens::Result image = lens_.distort({p.x() / p.z(), p.y() / p.z()});
  return {image.outcome, pixel_position(image.point)};
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "sensor/camera.h"

namespace truebox {

Camera::Camera(const CameraDescription& d) : pixels_(d.pixels), position_m_(d.position_m) {
  const Vec3 forward = d.direction.normalized();
  const Vec3 right = forward.cross(d.up).normalized();
  const Vec3 down = forward.cross(right);
  forward_ = d.focal_length_m * forward;
  right_per_px_ = d.film_m[0] / d.pixels[0] * right;
  down_per_px_ = d.film_m[1] / d.pixels[1] * down;
}

Ray Camera::ray(PixelPosition p) const {
  const Vec3 direction = forward_ + (p.x_px - 0.5 * pixels_[0]) * right_per_px_ +
                         (p.y_px - 0.5 * pixels_[1]) * down_per_px_;
  return {position_m_, direction.normalized()};
}

}  // namespace truebox

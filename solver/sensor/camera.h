// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "image/image.h"
#include "scene/scene.h"

namespace truebox {

/// A ray in world coordinates, m; the direction is a unit vector.
struct Ray {
  Vec3 origin_m = Vec3::Zero();
  Vec3 direction = Vec3::UnitZ();
};

/// Pinhole camera. Pixel (0, 0) is top left, seen from behind the camera: x runs along
/// direction x up, y against up.
class Camera {
 public:
  explicit Camera(const CameraDescription& description);

  int width_px() const { return pixels_[0]; }
  int height_px() const { return pixels_[1]; }

  /// The ray through a position on the film, (0.5, 0.5) being the centre of the top left pixel.
  Ray ray(PixelPosition position) const;

 private:
  std::array<int, 2> pixels_;
  Vec3 position_m_, forward_, right_per_px_, down_per_px_;  // forward: focal length in m
};

}  // namespace truebox

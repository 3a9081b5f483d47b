// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "image/image.h"
#include "sensor/lens.h"

namespace truebox {

/// A ray in world coordinates, m; the direction is a unit vector.
struct Ray {
  Vec3 origin_m = Vec3::Zero();
  Vec3 direction = Vec3::UnitZ();
};

/// A pinhole with a lens' distortion. Pixel (0, 0) is top left, seen from behind the camera: x runs
/// along direction x up, y against up. In the camera's frame x is right, y down, z forward.
class Camera {
 public:
  explicit Camera(const CameraDescription& description);

  int width_px() const { return pixels_[0]; }
  int height_px() const { return pixels_[1]; }

  /// The ray through a position on the film, (0.5, 0.5) being the centre of the top left pixel.
  /// Nothing where the lens images no direction (`LensOutcome::outside_field`).
  std::optional<Ray> ray(PixelPosition position) const;

  /// Where a point of the world appears, also beyond the film's edges.
  struct Projection {
    LensOutcome outcome = LensOutcome::not_run;
    PixelPosition position;  ///< meaningless unless the outcome is ok
  };
  Projection project(const Vec3& point_m) const;

  Vec3 camera_from_world(const Vec3& point_m) const;  ///< right, down, forward; m

  /// A position on the film in normalised image coordinates, distortion included, and back.
  NormalisedPoint normalised(PixelPosition position) const;
  PixelPosition pixel_position(const NormalisedPoint& image) const;

  const Lens& lens() const { return lens_; }

 private:
  std::array<int, 2> pixels_;
  Lens lens_;
  Vec3 position_m_, right_, down_, forward_;  // unit vectors
  std::array<double, 2> focal_px_, principal_point_px_;
};

}  // namespace truebox

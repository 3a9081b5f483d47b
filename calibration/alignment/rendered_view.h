// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "image/image.h"
#include "sensor/camera.h"

namespace truebox {

/// A rendered picture and where in the world its pixels lie: what a photograph is registered to.
///
/// Positions come from the render's AOVs (`surface.id`, `position.*`, `normal.*`, as `render --aov`
/// and `geometry_aovs` write them). Without AOVs the picture is taken for a print, flat and 1 m in
/// front of a camera, whose pixels are squares: a photograph is then registered to it as a whole
/// (a homography and the lens), which is exact where both were taken from one place.
class RenderedView {
 public:
  /// With AOVs; `camera` is the render's. MismatchError where sizes differ, InputError where a
  /// channel is missing.
  RenderedView(Image picture, const CameraDescription& camera, Image aovs);
  /// A print.
  explicit RenderedView(Image picture);

  const Image& picture() const { return picture_; }
  const CameraDescription& camera() const { return description_; }
  bool is_print() const { return !aovs_; }

  struct Place {
    int surface = 0;  ///< its id, 1 and up; of a print always 1
    Vec3 point_m = Vec3::Zero(), normal = Vec3::Zero();
  };
  /// What a pixel's centre shows; nothing where that is nothing.
  std::optional<Place> at_pixel(int x, int y) const;
  /// Where the ray through a place in the picture meets the plane of `place`.
  std::optional<Vec3> on_plane(const Place& place, PixelPosition position) const;

  std::string surface_name(int surface) const;

  /// The camera of a guess for a photograph of this size: the render's own, or, of a print, one
  /// that sees it fill the width.
  CameraDescription camera_for(int width_px, int height_px) const;

 private:
  Image picture_;
  CameraDescription description_;
  Camera camera_;
  std::optional<Image> aovs_;
  std::vector<std::size_t> layers_;  // channels: id, position x y z, normal x y z
};

/// Where a ray meets the plane through `point` with `normal`; nothing behind its origin.
std::optional<Vec3> ray_meets_plane(const Ray& ray, const Vec3& point, const Vec3& normal);

}  // namespace truebox

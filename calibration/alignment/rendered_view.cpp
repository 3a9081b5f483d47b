// SPDX-License-Identifier: BSD-3-Clause
#include "alignment/rendered_view.h"

#include <array>
#include <cmath>

#include "radiometry/input_error.h"

namespace truebox {
namespace {

constexpr std::array kLayers = {"surface.id", "position.X", "position.Y", "position.Z",
                                "normal.X",   "normal.Y",   "normal.Z"};
constexpr double kPrintFocal = 1.4;  // of the width: a field of 39 degrees, as of common lenses

CameraDescription print_camera(int width_px, int height_px) {
  CameraDescription camera;
  camera.direction = Vec3::UnitZ();
  camera.up = -Vec3::UnitY();  // so that world and camera axes are one
  camera.film_m = {0.036, 0.036 * height_px / width_px};
  camera.focal_length_m = kPrintFocal * 0.036;
  camera.pixels = {width_px, height_px};
  return camera;
}

}  // namespace

RenderedView::RenderedView(Image picture, const CameraDescription& camera, Image aovs)
    : picture_(std::move(picture)), description_(camera), camera_(camera), aovs_(std::move(aovs)) {
  if (aovs_->width != picture_.width || aovs_->height != picture_.height ||
      camera.pixels[0] != picture_.width || camera.pixels[1] != picture_.height)
    throw MismatchError("the render, its AOVs and its camera have different numbers of pixels");
  for (const char* name : kLayers) {
    const Channel* channel = aovs_->find(name);
    if (!channel)
      throw InputError(
          "AOVs", 0, std::string("a channel \"") + name + "\", as render --aov writes it", "none");
    layers_.push_back(static_cast<std::size_t>(channel - aovs_->channels.data()));
  }
}

RenderedView::RenderedView(Image picture)
    : picture_(std::move(picture)),
      description_(print_camera(picture_.width, picture_.height)),
      camera_(description_) {}

std::optional<RenderedView::Place> RenderedView::at_pixel(int x, int y) const {
  if (x < 0 || y < 0 || x >= picture_.width || y >= picture_.height) return std::nullopt;
  if (!aovs_) {
    const Place paper{1, Vec3::UnitZ(), -Vec3::UnitZ()};
    const auto point = on_plane(paper, {x + 0.5, y + 0.5});
    if (!point) return std::nullopt;
    return Place{1, *point, paper.normal};
  }
  const std::size_t i = picture_.index(x, y);
  const auto value = [&](std::size_t layer) -> double {
    return aovs_->channels[layers_[layer]].samples[i];
  };
  const Place place{static_cast<int>(std::lround(value(0))),
                    {value(1), value(2), value(3)},
                    {value(4), value(5), value(6)}};
  if (place.surface < 1 || !place.point_m.allFinite() || !(place.normal.norm() > 0.5))
    return std::nullopt;
  return place;
}

std::optional<Vec3> RenderedView::on_plane(const Place& place, PixelPosition position) const {
  const auto ray = camera_.ray(position);
  return ray ? ray_meets_plane(*ray, place.point_m, place.normal) : std::nullopt;
}

std::string RenderedView::surface_name(int surface) const {
  if (surface < 1) return "nothing";
  if (!aovs_) return "print";
  const auto found = aovs_->attributes.find("surface." + std::to_string(surface));
  return found == aovs_->attributes.end() ? "surface " + std::to_string(surface) : found->second;
}

CameraDescription RenderedView::camera_for(int width_px, int height_px) const {
  if (is_print()) return print_camera(width_px, height_px);
  CameraDescription camera = description_;
  camera.pixels = {width_px, height_px};
  return camera;
}

std::optional<Vec3> ray_meets_plane(const Ray& ray, const Vec3& point, const Vec3& normal) {
  const double towards = ray.direction.dot(normal);
  if (!(std::abs(towards) > 1e-9)) return std::nullopt;
  const double distance_m = (point - ray.origin_m).dot(normal) / towards;
  if (!(distance_m > 0.0)) return std::nullopt;
  return ray.origin_m + distance_m * ray.direction;
}

}  // namespace truebox

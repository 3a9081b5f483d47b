// SPDX-License-Identifier: BSD-3-Clause
#include "camera_attribute.h"

#include <filesystem>
#include <nlohmann/json.hpp>

#include "radiometry/input_error.h"

namespace truebox::app {
namespace {

using nlohmann::json;

json three(const Vec3& v) { return {v[0], v[1], v[2]}; }
Vec3 three(const json& v) {
  return {v.at(0).get<double>(), v.at(1).get<double>(), v.at(2).get<double>()};
}

}  // namespace

void note_camera(Image& image, const Scene& scene, const CameraDescription& camera) {
  const LensDistortion& d = camera.lens.distortion;
  const json text{
      {"position_m", three(camera.position_m)},
      {"direction", three(camera.direction)},
      {"up", three(camera.up)},
      {"focal_length_m", camera.focal_length_m},
      {"film_m", camera.film_m},
      {"principal_point_m", camera.lens.principal_point_m},
      {"distortion", {d.k1, d.k2, d.p1, d.p2, d.k3, d.k4, d.k5, d.k6, d.s1, d.s2, d.s3, d.s4}}};
  image.attributes["camera"] = text.dump();
  image.attributes["scene"] = scene.path;
}

std::optional<CameraDescription> noted_camera(const Image& image, const std::string& file) {
  const auto found = image.attributes.find("camera");
  if (found == image.attributes.end()) return std::nullopt;
  CameraDescription camera;
  try {
    const json text = json::parse(found->second);
    camera.position_m = three(text.at("position_m"));
    camera.direction = three(text.at("direction"));
    camera.up = three(text.at("up"));
    camera.focal_length_m = text.at("focal_length_m").get<double>();
    camera.film_m = text.at("film_m").get<std::array<double, 2>>();
    camera.lens.principal_point_m = text.at("principal_point_m").get<std::array<double, 2>>();
    const auto d = text.at("distortion").get<std::array<double, 12>>();
    camera.lens.distortion = {d[0], d[1], d[2], d[3], d[4],  d[5],
                              d[6], d[7], d[8], d[9], d[10], d[11]};
  } catch (const json::exception&) {
    throw InputError(file, 0, "an attribute \"camera\" as render writes it", found->second);
  }
  const bool sound = camera.position_m.allFinite() && camera.focal_length_m > 0.0 &&
                     camera.film_m[0] > 0.0 && camera.film_m[1] > 0.0 &&
                     camera.direction.cross(camera.up).norm() > 0.0;
  if (!sound) throw InputError(file, 0, "a camera in attribute \"camera\"", found->second);
  camera.pixels = {image.width, image.height};
  return camera;
}

std::optional<std::string> noted_scene(const Image& image, const std::string& file) {
  const auto found = image.attributes.find("scene");
  if (found == image.attributes.end()) return std::nullopt;
  const std::filesystem::path named = found->second;
  for (const auto& path : {named, std::filesystem::path(file).parent_path() / named.filename()})
    if (std::filesystem::is_regular_file(path)) return path.string();
  return std::nullopt;
}

}  // namespace truebox::app

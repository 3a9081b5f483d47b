// SPDX-License-Identifier: BSD-3-Clause
#include "align_render.h"

#include <array>
#include <fstream>

#include "alignment/render_mapping.h"
#include "camera_attribute.h"
#include "image/image_file.h"
#include "prediction_options.h"
#include "radiometry/input_error.h"
#include "scene/scene_file.h"
#include "sensor/aovs.h"

namespace truebox::app {

std::string AlignmentSubject::kind() const {
  if (!view) return "scene";
  return view->is_print() ? "print" : edges_of_view ? "render with AOVs" : "render";
}

bool is_picture_file(const std::string& path) {
  std::array<char, 4> start{};
  std::ifstream(path, std::ios::binary).read(start.data(), start.size());
  const std::string bytes(start.begin(), start.end());
  for (const char* magic : {"\x76\x2f\x31\x01", "\x89PNG", "\xff\xd8", "#?"})
    if (bytes.starts_with(magic)) return true;
  return bytes == std::string("II*\0", 4) || bytes == std::string("MM\0*", 4);
}

AlignmentSubject read_render(const std::string& path, const RenderOptionsOfAlign& options) {
  AlignmentSubject subject;
  subject.path = path;
  Image picture = read_image(path);
  std::optional<Image> aovs;
  if (!options.aovs.empty()) aovs = read_image(options.aovs);
  std::optional<CameraDescription> camera = noted_camera(picture, path);
  if (aovs && !camera) camera = noted_camera(*aovs, options.aovs);
  const auto scene_path = options.scene.empty()
                              ? (camera ? noted_scene(picture, path) : std::nullopt)
                              : std::optional(options.scene);
  if (scene_path) subject.scene = read_scene(*scene_path);
  if (!options.camera.empty() && !subject.scene)
    throw InputError(path, 0, "--scene with --camera", "a camera of no scene");
  if (subject.scene && (!options.camera.empty() || !camera)) {
    camera = find_camera(*subject.scene, options.camera);
    camera->pixels = {picture.width, picture.height};
  }
  if (aovs && !camera)
    throw InputError(options.aovs, 0, "AOVs that name their camera, as render --aov writes them",
                     "none; give --scene and --camera");
  if (!camera) {
    subject.view.emplace(std::move(picture));
    subject.edges_of_view = true;
    return subject;
  }
  if (!aovs && !subject.scene)
    throw InputError(path, 0, "its scene file, --scene, or its AOVs, --aov",
                     "only its camera: where its pixels lie is not known");
  subject.guess = *camera;
  subject.edges_of_view = aovs && options.scene.empty();
  if (!aovs) aovs = geometry_aovs(*subject.scene, Camera(*camera));
  subject.view.emplace(std::move(picture), *camera, std::move(*aovs));
  return subject;
}

BoxAlignment align_subject(const AlignmentSubject& subject, const Image& photograph,
                           const AlignmentOptions& options) {
  if (!subject.edges_of_view) return align_box(*subject.scene, subject.guess, photograph, options);
  if (options.stretch_u > 0.0)
    throw InputError(subject.path, 0, "--dimensions-u with a scene", "a picture");
  return align_picture(*subject.view, photograph, options);
}

void write_mapping(const std::filesystem::path& directory, const RenderedView& view,
                   const CameraParameters& parameters, const Image& photograph,
                   const std::string& photograph_path) {
  const Image mapping = photo_from_render(view, parameters, photograph.width, photograph.height);
  Image seen = in_render_pixels(photograph, mapping);
  seen.attributes["source"] = photograph_path + " in the pixels of a render (truebox align)";
  write_exr(directory / "photo_from_render.exr", mapping);
  write_exr(directory / "photograph.exr", seen);
}

}  // namespace truebox::app

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "alignment/box_alignment.h"
#include "alignment/rendered_view.h"
#include "scene/scene.h"

namespace truebox::app {

/// What a photograph is aligned to: a scene's polygons, or a rendered picture.
struct AlignmentSubject {
  std::string path;  ///< of the file that was named first
  std::optional<Scene> scene;
  CameraDescription guess;           ///< with a scene
  std::optional<RenderedView> view;  ///< with a render
  bool edges_of_view = false;        ///< of the picture, not of the scene

  std::string kind() const;  ///< "scene", "render", "render with AOVs", "print"
};

struct RenderOptionsOfAlign {
  std::string scene, camera, aovs;
};

/// Whether a file is a picture by its first bytes; a scene file otherwise.
bool is_picture_file(const std::string& path);

/// A render: its camera and scene from the options, else from what it says itself; without AOVs
/// its geometry from the scene; with neither, a print.
AlignmentSubject read_render(const std::string& path, const RenderOptionsOfAlign& options);

BoxAlignment align_subject(const AlignmentSubject& subject, const Image& photograph,
                           const AlignmentOptions& options);

/// photo_from_render.exr and photograph.exr: the mapping, and the photograph in the render's
/// pixels.
void write_mapping(const std::filesystem::path& directory, const RenderedView& view,
                   const CameraParameters& parameters, const Image& photograph,
                   const std::string& photograph_path);

}  // namespace truebox::app

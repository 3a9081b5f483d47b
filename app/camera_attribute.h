// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "image/image.h"
#include "scene/scene.h"

namespace truebox::app {

/// Says in a picture of whose camera it is: attributes "camera" (JSON, lengths in m) and "scene".
void note_camera(Image& image, const Scene& scene, const CameraDescription& camera);

/// The camera a picture was written with, in its own number of pixels; nothing where it does not
/// say. InputError (naming `file`) where what it says is malformed.
std::optional<CameraDescription> noted_camera(const Image& image, const std::string& file);

/// The scene file a picture names, if it is there: as named, else beside the picture.
std::optional<std::string> noted_scene(const Image& image, const std::string& file);

}  // namespace truebox::app

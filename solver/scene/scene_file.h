// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "scene/scene.h"

namespace truebox {

struct SceneFileOptions {
  /// Instead of the file's own bands so many over the same span, weighted by the scene's lamps (see
  /// lamp_weighting.h); 0: the file's own. A scene without [bands], or of
  /// all wavelengths in one, stays as it is.
  std::size_t lamp_weighted_bands = 0;
};

/// Reads a scene file (TOML): length_unit, [bands], [materials.*], [[surfaces]], [[openings]],
/// [cameras.*]. Spectral files are looked for beside the scene file.
/// InputError (file, line, what was expected, what stands there) for unknown keys, unknown
/// materials, rho outside [0, 1), negative emission, optical constants that no matter has, numbers
/// that are not finite, polygons without area or (beyond quads) not planar.
Scene read_scene(const std::filesystem::path& path, const SceneFileOptions& options = {});

}  // namespace truebox

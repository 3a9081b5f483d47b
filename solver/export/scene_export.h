// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "radiometry/observer.h"
#include "scene/scene.h"

namespace truebox {

enum class ExportFormat { mitsuba, pbrt, radiance, obj, gltf };

struct ExportOptions {
  Observer observer;   ///< turns spectra into colours and into the units of light
  std::string camera;  ///< the camera of a file that holds one; may be empty if there is one
  /// For files of three colours: the bands (nm) that red, green and blue carry, each exactly. None:
  /// the surfaces' colours under the scene's own light.
  std::optional<std::array<double, 3>> rgb_bands_nm;
};

/// What was written and what the reader must know: units, what the other program cannot hold.
struct ExportSummary {
  std::vector<std::filesystem::path> files;
  std::vector<std::string> notes;
};

/// Writes the scene for another renderer, lengths in m, openings left out; `target` is a folder, or
/// a file with the format's own ending (.xml .pbrt .rad .obj .gltf .glb). Each surface shines and
/// reflects as the other program's rules make it. Emitted radiance is L = M / pi:
///   mitsuba   spectra as they are, W m^-2 sr^-1 nm^-1; one film channel a band, its mean radiance
///   pbrt      lights are normalised to integral(L ybar) = 1: `scale` undoes it
///   radiance  RGB in W m^-2 sr^-1 with 179 lm/W over its own primaries and white
///   obj       Kd, Ke linear BT.709; Ke as the R, G, B of `truebox render`
///   gltf      linear BT.709; emission in cd m^-2 (683 lm/W)
/// Mirrors, rough conductors and clear dielectrics become the other program's own, by the same
/// equations in mitsuba and pbrt; radiance knows ideal mirrors and one refractive index; obj and
/// gltf are for looking at, and the notes say how they differ.
/// Spectra are written as steps, one a band; cameras as pinholes. InputError (naming the scene) for
/// an unknown camera or band, a target of another kind, or what the format cannot say.
ExportSummary export_scene(const Scene& scene, ExportFormat format,
                           const std::filesystem::path& target, const ExportOptions& options);

}  // namespace truebox

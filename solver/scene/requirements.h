// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "scene/scene.h"

namespace truebox {

/// What a scene needs to be modelled, decided from its geometry and materials alone; what it does
/// not need is left out, with the reason.
struct Requirements {
  bool occlusion = true;        ///< false if no surface can come between two others
  bool interreflection = true;  ///< false if no lit side faces another, or all are black
  bool path_tracing = false;    ///< true if a surface is not Lambertian: radiosity cannot do it
  std::vector<std::size_t> distinct_bands;  ///< bands to solve; the others are multiples of these
  std::vector<std::size_t> band_source;     ///< for each band, index into distinct_bands
  std::vector<double> band_scale;           ///< and its factor
  std::vector<std::string> reasons;         ///< one sentence a decision
};

/// Decides by exact tests: half-spaces for visibility; equal reflectances and proportional emission
/// for bands.
Requirements requirements(const Scene& scene);

/// InputError that names the surface and what to do if one is not Lambertian: radiosity would
/// silently be wrong.
void require_lambertian(const Scene& scene);

}  // namespace truebox

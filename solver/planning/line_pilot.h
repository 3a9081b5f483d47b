// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "adaptive/goal.h"

namespace truebox {

/// What elements along lines of light are worth to whoever interpolates between their corners, as
/// viewers of .vtu and .glb files do: root mean square over the area of exact direct light less
/// its interpolation, over its mean.
struct LinePilot {
  std::size_t elements = 0, elements_along = 0;  ///< of the two meshes
  double error = 0.0;                            ///< of elements that know no lines
  double error_along = 0.0;                      ///< of as many that follow them
  std::size_t lines = 0;                         ///< followed, contacts not counted
};

/// Both meshes as a prediction with about `elements` elements makes them, uniform or adapted to a
/// goal. std::length_error where a scene is too large to look for its lines.
LinePilot fly_line_pilot(const Scene& scene, std::size_t elements, const Goal* adapted_to);

}  // namespace truebox

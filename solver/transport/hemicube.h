// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "transport/form_factor.h"
#include "transport/visible_parts.h"

namespace truebox {

/// What a hemicube counted, and what its pixels can be wrong by.
struct HemicubeFactor {
  double factor = 0.0;          ///< of the element
  double aliasing_bound = 0.0;  ///< the pixels that an outline may cross, all counted against it
  std::size_t pixels = 0;       ///< that were looked at
};

/// View factor from an element through the pixels of half a cube about it: a pixel counts wholly if
/// the ray through its centre meets the source before any blocker. `resolution` pixels (even) along
/// an edge of the cube, 3 resolution^2 in all; their own factors are exact, so aliasing at outlines
/// is the only error, and it is bounded by the pixels that an outline may cross.
/// Source: Cohen & Greenberg (1985).
HemicubeFactor hemicube_factor(const Vec3& point, const Vec3& normal, std::span<const Vec3> source,
                               const Plane& source_plane, std::span<const Blocker* const> blockers,
                               int resolution);

/// Exchange area by hemicubes at 3 x 3 Gauss points on each quad of the receiver (m^2). The bound
/// is the aliasing and three times the difference to 2 x 2 points.
struct HemicubeExchange {
  double exchange_area_m2 = 0.0;
  double error_bound_m2 = 0.0;
  double aliasing_bound_m2 = 0.0;  ///< its share in the bound
  std::size_t pixels = 0;
};
HemicubeExchange hemicube_exchange(const PlanarPolygon& i, const PlanarPolygon& j,
                                   std::span<const Blocker* const> blockers, int resolution);

}  // namespace truebox

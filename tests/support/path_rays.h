// SPDX-License-Identifier: BSD-3-Clause
// Rays that turn a pixel into a measurement.
#pragma once

#include "path_tracer/path_tracer.h"

namespace truebox {

/// Every pixel is the mean over a parallelogram seen from straight above, `height_m` off it.
inline RayOfPixel looking_down_on(const Vec3& corner, const Vec3& edge_u, const Vec3& edge_v,
                                  double height_m) {
  const Vec3 normal = edge_u.cross(edge_v).normalized();
  return [=](int, int, UnitPair p) {
    return PixelRay{corner + p.u * edge_u + p.v * edge_v + height_m * normal, -normal};
  };
}

/// A picture of one ray.
inline RayOfPixel along(const Vec3& origin, const Vec3& direction) {
  return [=](int, int, UnitPair) { return PixelRay{origin, direction.normalized()}; };
}

}  // namespace truebox

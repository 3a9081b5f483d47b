// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "scene/polygon.h"

namespace truebox::app {

/// A place that a question is asked of; the normal is a unit vector.
struct ProbePoint {
  std::string name;
  Vec3 position_m, normal;
};

/// CSV with name,x,y,z,nx,ny,nz in the scene's unit. InputError.
std::vector<ProbePoint> read_points(const std::string& path, double metres_per_unit);

}  // namespace truebox::app

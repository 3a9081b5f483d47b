// SPDX-License-Identifier: BSD-3-Clause
// From image files to readings. Internal to this folder's sources.
#pragma once

#include "fit/scene_measurement_fit.h"

namespace truebox {

/// Adds the views, planes, readings and counts of every photograph of the measurement's file, as
/// its cameras and surfaces stand now. What was there before is replaced.
void add_planes(SceneMeasurement& measurement, const Progress& progress);

}  // namespace truebox

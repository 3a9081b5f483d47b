// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "sensor/camera.h"
#include "transport/prediction.h"

namespace truebox {

/// Which surface the centre of each pixel sees: an index into Scene::surfaces, row by row from the
/// top left; -1 where the ray leaves the scene. A back counts as its surface.
std::vector<int> visible_surfaces(const Prediction& prediction, const Camera& camera);

}  // namespace truebox

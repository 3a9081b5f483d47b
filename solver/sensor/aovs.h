// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "sensor/camera.h"
#include "transport/prediction.h"

namespace truebox {

/// What the centre of each pixel sees, never averaged (a mean of two surfaces is neither):
///   surface.id           1 and up, in the scene's order; names in attributes "surface.<id>"; 0
///   where
///                        nothing is, and for a black back
///   position.X, .Y, .Z   m, world
///   normal.X, .Y, .Z     1, towards the camera
///   coverage             1, share of the pixel's square that shows the same surface (16 points)
Image geometry_aovs(const Scene& scene, const Camera& camera);

/// The same and, at that point, irradiance and its error bound in each band, W m^-2 nm^-1, channels
/// "irradiance.<nm>nm" and "irradiance_bound.<nm>nm".
Image render_aovs(const Prediction& prediction, const Camera& camera);

}  // namespace truebox

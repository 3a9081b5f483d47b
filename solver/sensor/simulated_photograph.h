// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "sensor/exposure.h"
#include "sensor/render.h"

namespace truebox {

/// A picture that no camera took, and everything that is true of it.
struct SimulatedPhotograph {
  RenderedImage scene;  ///< spectral radiance through the distorted lens, and its bound
  SensorImage image;
};

/// Renders, exposes and reads out: each pixel is the mean over sub-pixel points that the lens'
/// inverse sends into the scene, then `photo_current` and `read_out`. One seed, one picture.
/// InputError as those two.
SimulatedPhotograph simulate_photograph(const Prediction& prediction,
                                        const CameraDescription& camera,
                                        const RenderOptions& options, std::uint64_t seed);

}  // namespace truebox

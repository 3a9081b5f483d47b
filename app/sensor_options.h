// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>

#include "scene/scene.h"

namespace CLI {
class App;
}

namespace truebox {
struct Image;
}

namespace truebox::app {

/// What `render` can be told about its camera's sensor.
struct SensorArguments {
  bool counts = false;
  double exposure_s = -1.0;  ///< instead of the scene's
  double auto_exposure_share = -1.0;
  std::uint64_t seed = 1;
};

void add_sensor_options(CLI::App& command, SensorArguments& arguments);

/// Whether sensor counts are wanted instead of spectral radiance: asked for, or a .tif or .png.
bool wants_counts(const SensorArguments& arguments, const std::string& output);

/// InputError unless the camera has a sensor and the output an ending that holds its counts.
void check_sensor(const SensorArguments& arguments, const std::string& output, const Scene& scene,
                  const CameraDescription& camera);

/// Exposes a spectral radiance image and writes the simulated photograph to `output`, its truth
/// (`spectral` too) beside it as .truth.exr, and what was simulated as .json. Returns a summary.
std::string write_simulated_photograph(const SensorArguments& arguments, const std::string& output,
                                       const Scene& scene, const CameraDescription& camera,
                                       const Image& spectral);

}  // namespace truebox::app

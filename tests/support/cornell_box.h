// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "scene/scene_file.h"

namespace truebox {

/// The published box in the seven bands of the independent renders: each band is its own problem,
/// so that nothing but time is saved.
inline Scene cornell_box_in_seven_bands() {
  return in_bands_at(
      read_scene(std::string(TRUEBOX_REFERENCE_DIR) + "/cornell_box/cornell_box.toml"),
      {400.0, 452.0, 500.0, 552.0, 600.0, 652.0, 700.0});
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <string>

#include "scene/scene_file.h"

namespace truebox {

/// The published box in the seven bands of the independent renders: each band is its own problem,
/// so that nothing but time is saved.
inline Scene cornell_box_in_seven_bands() {
  const Scene full =
      read_scene(std::string(TRUEBOX_REFERENCE_DIR) + "/cornell_box/cornell_box.toml");
  Scene part = full;
  std::vector<double> centres;
  std::vector<std::size_t> kept;
  for (double nm : {400.0, 452.0, 500.0, 552.0, 600.0, 652.0, 700.0})
    for (std::size_t b = 0; b < full.bands.size(); ++b)
      if (std::abs(full.bands.centre_nm(b) - nm) < 1e-6) {
        kept.push_back(b);
        centres.push_back(nm);
      }
  part.bands = WavelengthGrid::from_centres(centres);
  for (std::size_t m = 0; m < full.materials.size(); ++m) {
    part.materials[m].reflectance.values.clear();
    part.materials[m].exitance.values.clear();
    for (std::size_t b : kept) {
      part.materials[m].reflectance.values.push_back(full.materials[m].reflectance[b]);
      part.materials[m].exitance.values.push_back(full.materials[m].exitance[b]);
    }
  }
  return part;
}

}  // namespace truebox

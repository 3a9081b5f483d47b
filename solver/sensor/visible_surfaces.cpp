// SPDX-License-Identifier: BSD-3-Clause
#include "sensor/visible_surfaces.h"

namespace truebox {

std::vector<int> visible_surfaces(const Prediction& prediction, const Camera& camera) {
  std::vector<int> surfaces;
  for (int y = 0; y < camera.height_px(); ++y)
    for (int x = 0; x < camera.width_px(); ++x) {
      const auto ray = camera.ray({x + 0.5, y + 0.5});
      const auto hit =
          ray ? prediction.visibility().first_hit(ray->origin_m, ray->direction) : std::nullopt;
      surfaces.push_back(hit ? static_cast<int>(prediction.fine().mesh.pieces[hit->piece].surface)
                             : -1);
    }
  return surfaces;
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "scene/scene.h"

#include <algorithm>

namespace truebox {

bool Material::emits() const {
  return std::any_of(exitance.values.begin(), exitance.values.end(),
                     [](double v) { return v > 0.0; });
}

double Scene::diameter_m() const {
  Eigen::AlignedBox3d box;
  for (const Surface& surface : surfaces)
    for (const Polygon& piece : surface.pieces)
      for (const Vec3& v : piece) box.extend(v);
  return box.isEmpty() ? 0.0 : box.diagonal().norm();
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "scene/scene.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

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

Scene in_bands(const Scene& scene, const std::vector<std::size_t>& bands) {
  Scene part = scene;
  const auto pick = [&](const std::vector<double>& from) {
    std::vector<double> values;
    if (from.empty()) return values;
    values.reserve(bands.size());
    for (std::size_t b : bands) values.push_back(from[b]);
    return values;
  };
  part.bands = WavelengthGrid::from_centres(pick(scene.bands.centres_nm()));
  for (Material& material : part.materials) {
    material.reflectance.values = pick(material.reflectance.values);
    material.exitance.values = pick(material.exitance.values);
    material.refractive_index.values = pick(material.refractive_index.values);
    material.absorption_index.values = pick(material.absorption_index.values);
  }
  return part;
}

Scene in_bands_at(const Scene& scene, const std::vector<double>& centres_nm) {
  std::vector<std::size_t> bands;
  for (double nm : centres_nm) {
    std::size_t b = 0;
    while (b < scene.bands.size() && std::abs(scene.bands.centre_nm(b) - nm) > 0.01) ++b;
    if (b == scene.bands.size())
      throw std::invalid_argument("no band at " + std::to_string(nm) + " nm");
    bands.push_back(b);
  }
  return in_bands(scene, bands);
}

}  // namespace truebox

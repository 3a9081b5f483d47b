// SPDX-License-Identifier: BSD-3-Clause
#include "transport/net_flux.h"

namespace truebox {

using Eigen::Index;

std::vector<SurfaceFlux> net_fluxes(const Prediction& prediction) {
  const Scene& scene = prediction.scene();
  const SurfaceMeans means = prediction.surface_means();
  const Index bands = means.irradiance.cols();
  std::vector<SurfaceFlux> fluxes;
  for (std::size_t s = 0; s < scene.surfaces.size(); ++s) {
    if (scene.surfaces[s].is_opening) continue;
    const Material& material = scene.material_of(scene.surfaces[s]);
    const Eigen::Map<const Eigen::ArrayXd> rho(material.reflectance.values.data(), bands);
    const Eigen::Map<const Eigen::ArrayXd> exitance(material.exitance.values.data(), bands);
    const auto row = static_cast<Index>(s);
    const double area_m2 = means.area_m2[row];
    SurfaceFlux flux{scene.surfaces[s].name, area_m2, {}, {}};
    flux.net_W = area_m2 * (exitance - (1.0 - rho) * means.irradiance.row(row).transpose().array());
    flux.bound_W = area_m2 * (1.0 - rho) * means.error_bound.row(row).transpose().array();
    fluxes.push_back(std::move(flux));
  }
  return fluxes;
}

}  // namespace truebox

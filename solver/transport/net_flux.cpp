// SPDX-License-Identifier: BSD-3-Clause
#include "transport/net_flux.h"

namespace truebox {

using Eigen::Index;

std::vector<SurfaceFlux> net_fluxes(const Prediction& prediction) {
  const Scene& scene = prediction.scene();
  const PatchMesh& mesh = prediction.fine().mesh;
  const BandMatrix irradiance = prediction.irradiance();
  const BandMatrix bound = prediction.surface_irradiance_bound();
  const Index bands = irradiance.cols();
  std::vector<SurfaceFlux> fluxes;
  std::vector<Eigen::VectorXd> incident(scene.surfaces.size(), Eigen::VectorXd::Zero(bands));
  std::vector<double> area(scene.surfaces.size(), 0.0);
  for (std::size_t i = 0; i < mesh.size(); ++i) {
    if (!prediction.fine().usable[i]) continue;
    const std::size_t surface = mesh.surface_of(mesh.patches[i]);
    const double free_m2 = prediction.fine().free_area_m2[static_cast<Index>(i)];
    incident[surface] += free_m2 * irradiance.row(static_cast<Index>(i)).transpose();
    area[surface] += free_m2;
  }
  for (std::size_t s = 0; s < scene.surfaces.size(); ++s) {
    if (scene.surfaces[s].is_opening) continue;
    const Material& material = scene.material_of(scene.surfaces[s]);
    const Eigen::Map<const Eigen::ArrayXd> rho(material.reflectance.values.data(), bands);
    const Eigen::Map<const Eigen::ArrayXd> exitance(material.exitance.values.data(), bands);
    SurfaceFlux flux{scene.surfaces[s].name, area[s], {}, {}};
    flux.net_W = area[s] * exitance - (1.0 - rho) * incident[s].array();
    flux.bound_W = area[s] * (1.0 - rho) * bound.row(static_cast<Index>(s)).transpose().array();
    fluxes.push_back(std::move(flux));
  }
  return fluxes;
}

}  // namespace truebox

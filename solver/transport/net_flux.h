// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "transport/prediction.h"

namespace truebox {

/// Net radiant flux that leaves a surface, one value a band: W, or W nm^-1 in bands by wavelength.
///   Phi = A (M - (1 - rho) E),   its bound A (1 - rho) times that of the mean irradiance E.
/// Positive: the surface must be heated to keep its temperature. Source: Hottel & Sarofim (1967).
struct SurfaceFlux {
  std::string surface;
  double area_m2 = 0.0;
  Eigen::VectorXd net_W, bound_W;
};

/// Of every surface that is not an opening.
std::vector<SurfaceFlux> net_fluxes(const Prediction& prediction);

}  // namespace truebox

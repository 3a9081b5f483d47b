// SPDX-License-Identifier: BSD-3-Clause
#include "transport/sensitivity.h"

namespace truebox {
namespace {

using Eigen::Index;

void keep_material(BandMatrix& matrix, const std::vector<char>& is_in_material) {
  for (Index i = 0; i < matrix.rows(); ++i)
    if (!is_in_material[static_cast<std::size_t>(i)]) matrix.row(i).setZero();
}

}  // namespace

SolveSummary reflectance_sensitivity(const SolvedSystem& system,
                                     const std::vector<char>& is_in_material,
                                     const SolveOptions& options, BandMatrix& derivative) {
  BandMatrix source = system.direct + system.irradiance;
  keep_material(source, is_in_material);
  return solve_radiosity(system.exchange, system.rho, source, options, derivative);
}

SolveSummary exitance_sensitivity(const SolvedSystem& system,
                                  const std::vector<char>& is_in_material,
                                  const SolveOptions& options, BandMatrix& derivative) {
  BandMatrix source = BandMatrix::Ones(system.rho.rows(), system.rho.cols());
  keep_material(source, is_in_material);
  return solve_radiosity(system.exchange, system.rho, source, options, derivative);
}

AdjointSensitivity adjoint_sensitivity(const SolvedSystem& system, const BandMatrix& weight,
                                       const SolveOptions& options) {
  const auto inverse_area = system.exchange.area_m2().cwiseInverse().asDiagonal();
  const BandMatrix source = inverse_area * system.rho.cwiseProduct(weight);
  AdjointSensitivity result;
  BandMatrix z;
  result.summary = solve_radiosity(system.exchange, system.rho, source, options, z);
  result.by_exitance = weight + system.exchange.product(z);
  result.by_reflectance = result.by_exitance.cwiseProduct(system.direct + system.irradiance);
  return result;
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "transport/polynomial_means.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "mesh/graded_mesh.h"
#include "scene/requirements.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr double kGrading = 3.0;  // t^3 towards edges; pays from degree 2 on
constexpr double kReserve = 1.15, kSmallestStep = 1.5, kLargestStep = 8.0;

BandMatrix of_surfaces(const Scene& scene, const std::vector<double>& (*values)(const Material&)) {
  BandMatrix all(static_cast<Index>(scene.surfaces.size()), static_cast<Index>(scene.bands.size()));
  for (Index s = 0; s < all.rows(); ++s)
    all.row(s) = Eigen::Map<const Eigen::RowVectorXd>(
        values(scene.material_of(scene.surfaces[static_cast<std::size_t>(s)])).data(), all.cols());
  return all;
}

BandMatrix expanded(const BandMatrix& distinct, const Requirements& needs) {
  BandMatrix all(distinct.rows(), static_cast<Index>(needs.band_source.size()));
  for (Index b = 0; b < all.cols(); ++b) {
    const auto band = static_cast<std::size_t>(b);
    all.col(b) = needs.band_scale[band] * distinct.col(static_cast<Index>(needs.band_source[band]));
  }
  return all;
}

}  // namespace

double PolynomialMeans::largest_relative_bound() const {
  double largest = 0.0;
  for (Index s = 0; s < irradiance.rows(); ++s)
    for (Index k = 0; k < irradiance.cols(); ++k)
      if (irradiance(s, k) > 0.0)
        largest = std::max(largest, irradiance_bound(s, k) / irradiance(s, k));
  return largest;
}

PolynomialMeans polynomial_means(const Scene& scene, const PolynomialOptions& options) {
  require_lambertian(scene);
  const Requirements needs = requirements(scene);
  const Scene distinct = in_bands(scene, needs.distinct_bands);
  const double edge_m = edge_for_count(distinct, options.elements);
  const PatchMesh mesh =
      options.degree > 1 ? graded_mesh(distinct, edge_m, kGrading) : uniform_mesh(distinct, edge_m);
  GalerkinOptions galerkin;
  galerkin.degree = options.degree;
  galerkin.relative_tolerance = options.kernel_tolerance;
  galerkin.memory_limit_bytes = options.memory_limit_bytes;
  const GalerkinSystem system(mesh, distinct, galerkin);
  const BandMatrix rho = of_surfaces(distinct, [](const Material& m) -> const std::vector<double>& {
    return m.reflectance.values;
  });
  const BandMatrix exitance = of_surfaces(
      distinct, [](const Material& m) -> const std::vector<double>& { return m.exitance.values; });
  PolynomialMeans result;
  result.degree = options.degree;
  result.elements = mesh.size();
  result.unknowns = system.unknowns();
  BandMatrix coefficients;
  result.solve = system.solve(rho, system.project_constants(exitance), coefficients);
  const BandMatrix mean = system.surface_means(coefficients);
  const BandMatrix bound = system.mean_error_bound(rho, exitance, coefficients);
  BandMatrix irradiance = BandMatrix::Zero(mean.rows(), mean.cols()), its_bound = irradiance;
  for (Index s = 0; s < mean.rows(); ++s)
    for (Index k = 0; k < mean.cols(); ++k)
      if (rho(s, k) > 0.0 && !scene.surfaces[static_cast<std::size_t>(s)].is_opening) {
        irradiance(s, k) = (mean(s, k) - exitance(s, k)) / rho(s, k);
        its_bound(s, k) = bound(s, k) / rho(s, k);
      }
  result.radiosity = expanded(mean, needs);
  result.radiosity_bound = expanded(bound, needs);
  result.irradiance = expanded(irradiance, needs);
  result.irradiance_bound = expanded(its_bound, needs);
  return result;
}

double bound_order(int degree) {
  constexpr std::array<double, 5> kOrders = {0.79, 1.06, 1.75, 2.31, 2.66};
  return kOrders.at(static_cast<std::size_t>(degree));
}

double kernel_tolerance_for(double relative_error) {
  return std::clamp(1e-3 * relative_error, 1e-9, 1e-5);
}

TargetedMeans polynomial_means_to_target(const Scene& scene, PolynomialOptions options,
                                         double relative_error) {
  if (!(relative_error > 0.0 && relative_error < 1.0))
    throw std::invalid_argument("a target error lies between 0 and 1");
  TargetedMeans result;
  while (true) {
    try {
      result.means = polynomial_means(scene, options);
    } catch (const std::length_error&) {
      if (result.steps.empty()) throw;
      return result;
    }
    const double bound = result.means.largest_relative_bound();
    result.steps.push_back({result.means.elements, bound});
    if (result.means.solve.outcome != SolveOutcome::converged) return result;
    result.is_reached = bound <= relative_error;
    if (result.is_reached) return result;
    const double wanted =
        kReserve * std::pow(bound / relative_error, 1.0 / bound_order(options.degree));
    // Requests near each other may give the same mesh: what was asked for grows with what came.
    options.elements = static_cast<std::size_t>(
        static_cast<double>(std::max(options.elements, result.means.elements)) *
        std::clamp(wanted, kSmallestStep, kLargestStep));
  }
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "scene/scene.h"
#include "transport/galerkin.h"
#include "transport/predict_to_target.h"

namespace truebox {

struct PolynomialOptions {
  int degree = 2;             ///< 1 to kMaxElementDegree
  std::size_t elements = 32;  ///< about
  /// Of the kernel's moments; what that costs is in the bound.
  double kernel_tolerance = 1e-8;
  std::size_t memory_limit_bytes = std::size_t{8} << 30;
};

/// Means of the surfaces by polynomials on elements (GalerkinSystem), which are graded towards
/// edges from degree 2 on; surfaces x bands, W m^-2 nm^-1. Openings have zeros.
struct PolynomialMeans {
  int degree = 0;
  std::size_t elements = 0;
  Eigen::Index unknowns = 0;
  SolveSummary solve;
  BandMatrix radiosity, radiosity_bound;
  /// (B - M) / rho; zeros where a surface reflects nothing: its light is not found this way.
  BandMatrix irradiance, irradiance_bound;

  /// Largest bound of a mean irradiance relative to it, where there is one.
  double largest_relative_bound() const;
};

/// Solves the bands that need it, expands to all. The bound falls like elements^-bound_order.
/// InputError if a surface is not Lambertian; std::length_error above the memory limit.
PolynomialMeans polynomial_means(const Scene& scene, const PolynomialOptions& options);

/// Measured on the cube that its ceiling lights: means converge twice as fast as the energy norm
/// (tests/verification/basis_convergence_test.cpp).
double bound_order(int degree);

/// With as many elements as bring largest_relative_bound() down to the target, from
/// options.elements on; each attempt is told in `steps`. Ends where the next does not fit.
struct TargetedMeans {
  PolynomialMeans means;
  std::vector<TargetStep> steps;
  bool is_reached = false;
};
TargetedMeans polynomial_means_to_target(const Scene& scene, PolynomialOptions options,
                                         double relative_error);

/// The tolerance of the kernel's moments that a target needs.
double kernel_tolerance_for(double relative_error);

}  // namespace truebox

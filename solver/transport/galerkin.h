// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "mesh/patch_mesh.h"
#include "transport/polynomial_element.h"
#include "transport/solve_radiosity.h"
#include "transport/visible_moments.h"

namespace truebox {

struct GalerkinOptions {
  int degree = 1;                    ///< 0 constant, 1 (bi)linear, ... kMaxElementDegree
  double relative_tolerance = 1e-9;  ///< of the kernel's moments, each pair
  double relative_bound = 1e-11;     ///< of the linear solve, coefficients against the largest
  std::size_t memory_limit_bytes = std::size_t{8} << 30;
  std::string invalid() const;  ///< why these options cannot be used; empty if they can
};

/// Radiosity as polynomials on elements, by Galerkin's method:
///   B~ = sum_f c_f phi_f,   c_f = <phi_f, M> + rho sum_g K_fg c_g,
///   K_fg = 1/pi int int phi_f(x) cos_x cos_y / r^2 phi_g(y) dA_y dA_x
/// with phi orthonormal over its element, so that K is symmetric and any solver of constant
/// elements solves it. Degree p: the error falls like h^(p+1) where B is smooth. Coefficients
/// are W m^-1 nm^-1: radiosity times sqrt(area).
/// Pairs with something in between take exact visibility from Gauss points (VisibleMoments): the
/// order is seen until the kinks of shadows show, some 1e-4. n^2 doubles of memory. Openings are
/// left out: they send and receive nothing. So are elements under other surfaces.
/// Throws std::invalid_argument for invalid options, std::length_error above the memory limit.
/// Sources: Heckbert & Winget (1991); Zatz (1993); Troutman & Max (1993).
class GalerkinSystem {
 public:
  GalerkinSystem(const PatchMesh& mesh, const Scene& scene, const GalerkinOptions& options);

  /// The same elements with fewer polynomials: a block of the same matrix.
  GalerkinSystem at_degree(int degree) const;

  /// Of this system's unknowns, those a lower degree has too.
  std::vector<Eigen::Index> unknowns_of_degree(int degree) const;

  Eigen::Index unknowns() const { return factors_.size(); }
  std::size_t surfaces() const { return surface_count_; }
  const Eigen::MatrixXd& kernel() const { return factors_.exchange_area_m2; }

  /// Best approximation of a function in the least-squares sense; one column.
  using Function = std::function<double(std::size_t surface, const Vec3& point)>;
  Eigen::VectorXd project(const Function& function) const;

  /// <phi_f, M> of exitances that are constant on each surface, surfaces x bands.
  BandMatrix project_constants(const BandMatrix& exitance) const;

  /// `reflectance` surfaces x bands, `source` <phi_f, M> and `coefficients` unknowns x bands.
  /// The summary's bound is of the linear system alone.
  SolveSummary solve(const BandMatrix& reflectance, const BandMatrix& source,
                     BandMatrix& coefficients) const;

  /// Root of the integral of (B~ - f)^2 over all surfaces; f as smooth as degree 2 p + 4.
  double distance_to(const Eigen::VectorXd& coefficients, const Function& function) const;

  /// Mean radiosity of each surface, surfaces x bands (0 for openings).
  BandMatrix surface_means(const BandMatrix& coefficients) const;

  /// What surface_means can be wrong by, for exitances constant on each surface. With the
  /// self-adjoint A = 1 / rho - K, residual s = A (B - B~), and the same for the solution z of
  /// A z = (weight of the mean):
  ///   |mean| <= |<z~, s>| + ||s|| ||s_z|| / (1 / max rho - 1)
  /// because ||K|| <= 1. Products of two errors: it falls twice as fast as the error of B~. The
  /// residuals are gathered point by point and hold the errors of discretisation, of the moments
  /// and of the solve at once. Source: energy norm estimates, Ainsworth & Oden (2000), ch. 6.
  BandMatrix mean_error_bound(const BandMatrix& reflectance, const BandMatrix& exitance,
                              const BandMatrix& coefficients) const;

 private:
  GalerkinSystem() = default;
  void number_unknowns();
  void integrate_kernel();
  Eigen::MatrixXd moments_of(const PolynomialElement& i, const PolynomialElement& j) const;
  /// int K B~ at the points of a crowded rule on element e: points x columns.
  Eigen::MatrixXd gathered(std::size_t e, const std::vector<Vec3>& points,
                           const Eigen::MatrixXd& coefficients) const;

  GalerkinOptions options_;
  std::size_t surface_count_ = 0;
  std::shared_ptr<const VisibleMoments> visible_;  // nothing where nothing can be in between
  std::vector<PolynomialElement> elements_;
  std::vector<std::size_t> surface_;  // of each element
  std::vector<Eigen::Index> first_;   // unknown of each element, and their count
  FormFactors factors_;               // K as exchange areas of elements of unit area
};

}  // namespace truebox

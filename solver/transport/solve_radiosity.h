// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "transport/form_factors.h"

namespace truebox {

enum class SolveMethod { conjugate_gradient, gauss_seidel };
enum class SolveOutcome { not_run, converged, iteration_limit, diverged };

struct SolveOptions {
  SolveMethod method = SolveMethod::conjugate_gradient;
  double relative_bound =
      1e-7;  ///< stop when the bound is below this share of max |B| in each band
  int iteration_limit = 10000;
  std::string invalid() const;  ///< why these options cannot be used; empty if they can
};

struct SolveSummary {
  SolveOutcome outcome = SolveOutcome::not_run;
  int iterations = 0;
  int matrix_passes = 0;                 ///< passes over S, all bands at once
  std::vector<double> residual_history;  ///< max over bands of ||r||_inf / ||B||_inf
  Eigen::VectorXd error_bound;           ///< for each band, of any element, W m^-2 nm^-1
  std::string brief() const;
};

/// Solves, in every band at once,
///   B = M + diag(rho) F B,      F_ij = S_ij / A_i,
/// `rho`, `source` M and `radiosity` B all elements x bands, M and B in W m^-2 nm^-1.
/// Gauss-Seidel gathers row by row; conjugate gradients work on the symmetrised system
/// (diag(A / rho) - S) B = diag(A / rho) M, scaled by its diagonal, black elements eliminated.
/// Exact only for Lambertian surfaces. A posteriori, with q = max rho * max row sum < 1:
///   ||B - B~||_inf <= ||M + diag(rho) F B~ - B~||_inf / (1 - q).
/// Throws std::invalid_argument if options.invalid().
/// Sources: Goral et al. (1984); Cohen & Wallace (1993), ch. 5; Neumann (1994).
SolveSummary solve_radiosity(const FormFactors& factors, const BandMatrix& rho,
                             const BandMatrix& source, const SolveOptions& options,
                             BandMatrix& radiosity, const Progress& progress = {});

}  // namespace truebox

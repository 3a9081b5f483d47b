// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "transport/exchange_operator.h"

namespace truebox {

/// How B = M + diag(rho) F B is solved.
enum class SolveMethod {
  direct,              ///< Cholesky factorisation, band by band; n^3 / 3 each
  jacobi,              ///< every element gathers from the last sweep: one bounce a sweep
  gauss_seidel,        ///< gathering, row by row, from what is newest
  southwell,           ///< progressive refinement: the brightest unshot element shoots
  southwell_ambient,   ///< the same, the unshot rest shown as an ambient term
  conjugate_gradient,  ///< on the symmetrised system
  gmres,               ///< on the radiosity system itself (Eigen)
  bicgstab             ///< on the radiosity system itself (Eigen)
};

enum class SolveOutcome { not_run, converged, iteration_limit, diverged };

/// The name a user types ("gauss-seidel") and back; std::invalid_argument for another name.
std::string method_name(SolveMethod method);
SolveMethod method_of_name(const std::string& name);
std::vector<std::string> method_names();

struct SolveOptions {
  SolveMethod method = SolveMethod::conjugate_gradient;
  double relative_bound =
      1e-7;  ///< stop when the bound is below this share of max |B| in each band
  int iteration_limit = 10000;
  /// Instead of conjugate gradients one space of functions for all bands (see reduced_basis.h),
  /// from twelve bands on. The bound is the same.
  bool share_bands = true;
  /// Told the radiosity (elements x bands) and the work so far, in passes over S; may be empty.
  std::function<void(double matrix_passes, const BandMatrix& radiosity)> on_progress;

  std::string invalid() const;  ///< why these options cannot be used; empty if they can
};

struct SolveSummary {
  SolveOutcome outcome = SolveOutcome::not_run;
  int iterations = 0;                    ///< sweeps, steps, or shots of one element
  double matrix_passes = 0.0;            ///< over S for all bands; a shot is 1/n of one
  std::vector<double> residual_history;  ///< max over bands of ||r||_inf / ||B||_inf
  Eigen::VectorXd error_bound;           ///< for each band, of any element, W m^-2 nm^-1
  int bands_reduced = 0;                 ///< bands less the most products of one pass
  std::string brief() const;
};

/// Solves, in every band at once,
///   B = M + diag(rho) F B,      F_ij = S_ij / A_i,
/// `rho`, `source` M and `radiosity` B all elements x bands, M and B in W m^-2 nm^-1.
/// Exact only for Lambertian surfaces. A posteriori, with q = max rho * max row sum < 1:
///   ||B - B~||_inf <= ||M + diag(rho) F B~ - B~||_inf / (1 - q).
/// `irradiance`, if asked for, is F B, good to the same bound times the largest row sum.
/// Throws std::invalid_argument if options.invalid(), or where a reflectance is not in [0, 1).
/// Sources: Goral et al. (1984); Cohen et al. (1988), progressive refinement; Cohen & Wallace
/// (1993), ch. 5; Neumann (1994); Gortler, Cohen & Slusallek (1994).
SolveSummary solve_radiosity(const ExchangeOperator& exchange, const BandMatrix& rho,
                             const BandMatrix& source, const SolveOptions& options,
                             BandMatrix& radiosity, const Progress& progress = {},
                             BandMatrix* irradiance = nullptr);
SolveSummary solve_radiosity(const FormFactors& factors, const BandMatrix& rho,
                             const BandMatrix& source, const SolveOptions& options,
                             BandMatrix& radiosity, const Progress& progress = {},
                             BandMatrix* irradiance = nullptr);

}  // namespace truebox

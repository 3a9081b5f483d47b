// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "transport/solve_radiosity.h"

namespace truebox {

/// A solved system B = M + diag(rho) F B whose source is M = E + diag(rho) D: own exitance E and
/// irradiance D that came straight from outside the system (0 where the lamps are elements).
struct SolvedSystem {
  const ExchangeOperator& exchange;
  const BandMatrix& rho;
  const BandMatrix& direct;      ///< D, W m^-2 nm^-1
  const BandMatrix& irradiance;  ///< F B
};

/// dB / d rho_m (elements x bands) of the reflectance that the elements with `is_in_material`
/// share:
///   (I - diag(rho) F) dB = diag(1_m) (D + F B).
/// One solve for each material. Source: differentiated radiosity equation; Marks et al. (1990).
SolveSummary reflectance_sensitivity(const SolvedSystem& system,
                                     const std::vector<char>& is_in_material,
                                     const SolveOptions& options, BandMatrix& derivative);

/// dB / dE_m of the exitance those elements share: (I - diag(rho) F) dB = 1_m.
SolveSummary exitance_sensitivity(const SolvedSystem& system,
                                  const std::vector<char>& is_in_material,
                                  const SolveOptions& options, BandMatrix& derivative);

/// Derivatives of J = sum_i g_i B_i, one J a band, by every element's rho and E at once.
struct AdjointSensitivity {
  BandMatrix by_reflectance;  ///< dJ / d rho_i, elements x bands
  BandMatrix by_exitance;     ///< dJ / dE_i
  SolveSummary summary;
};

/// One solve whatever the number of reflectances: lambda = g + F^T diag(rho) lambda, of which
/// z = diag(rho / A) lambda solves the radiosity system for the source diag(rho / A) g, since S is
/// symmetric. dJ/dE = lambda, dJ/d rho = lambda (D + F B). Source: Giles & Pierce (2000).
AdjointSensitivity adjoint_sensitivity(const SolvedSystem& system, const BandMatrix& weight,
                                       const SolveOptions& options);

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "fit/fit_summary.h"
#include "radiometry/estimate.h"

namespace truebox {

/// The mean of a few photosites well inside one patch.
struct PatchBlock {
  double x = 0.0, y = 0.0;  ///< position, scaled so that the chart spans about [-1, 1]
  double value = 0.0;       ///< DN s^-1
  double standard_uncertainty = 0.0;
  std::size_t patch = 0;
};

/// One band of a chart. A patch with a standard is known (value and u), the others are fitted.
struct ChartProblem {
  std::vector<std::string> patches;
  std::vector<PatchBlock> blocks;
  std::vector<std::optional<Estimate>> standards;  ///< one a patch
};

struct ChartFitOptions {
  int field_order = 2;    ///< total degree of the illumination polynomial
  bool fit_veil = false;  ///< the additive term s of the model
  int max_iterations = 100;
  std::optional<std::string> invalid(const ChartProblem& problem) const;  ///< why, if so
};

/// Model of a block at (x, y) on patch p:
///   value = g (rho_p + s) E(x, y),   E = 1 + sum_{1 <= i + j <= order} c_ij x^i y^j
/// g gain (DN s^-1 per unit of reflectance), E relative illumination (1), s veil: light that adds
/// to every patch in proportion to the illumination, in units of reflectance. A standard q adds
/// the residual (rho_q - known) / u. 0 <= rho.
/// Identifiable because each patch is uniform: gradients inside the patches fix E in every
/// direction, the standards fix g, and s too where they span a range of reflectance.
struct ChartFit {
  FitSummary summary;
  std::vector<Estimate> reflectance;  ///< one a patch; u is meaningless where at_bound
  std::vector<bool> at_bound;
  double gain = 0.0;
  Estimate veil;
  int field_order = 0;
  std::vector<double> field;  ///< c_ij in the order of field_terms()

  double illumination(double x, double y) const;  ///< E(x, y)
};

/// (x^1 y^0, x^0 y^1, x^2 y^0, x^1 y^1, ...): the terms of E after the constant.
std::vector<double> field_terms(int order, double x, double y);

/// Weighted least squares (Levenberg-Marquardt). Uncertainties come from the covariance with the
/// blocks' sigmas enlarged by sqrt(chi^2/nu) where that exceeds 1, those of the standards as given.
/// A parameter at its bound is held there for the covariance and flagged, never given a sigma.
ChartFit fit_chart(const ChartProblem& problem, const ChartFitOptions& options);

/// The largest relative difference between the analytic Jacobian and a numeric one (Ridders'
/// method) over all residuals of the problem, at the given reflectance level. For tests.
double largest_jacobian_error(const ChartProblem& problem, const ChartFitOptions& options);

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "radiometry/estimate.h"

namespace truebox {

/// What a camera makes of a linear signal x (DN):
///   reading = offset + x - curvature x^2
/// The offset is the black level below the digital zero, which dark frames clipped at 0 cannot
/// show; the curvature is the onset of saturation. Only exposure series reveal both.
/// Where a camera's files are tone-mapped a table takes their place: the signal of each whole
/// reading 0, 1, 2, ... (`response_curve.h`).
struct CameraResponse {
  Estimate offset_dn;
  Estimate curvature_per_dn;
  std::vector<Estimate> table_dn{};  ///< signal at each whole reading, rising; empty: no table

  double linear_dn(double reading_dn) const;  ///< x of a reading; monotone, 0 at offset
  double slope(double signal_dn) const;       ///< d reading / d x
  double reading_dn(double signal_dn) const;
};

/// Readings of one steady, uniform area at several exposure times.
struct ExposureSeries {
  std::vector<double> exposures_s;
  std::vector<double> readings_dn;
};

/// Least squares over series with weights 1 / (0.3 DN + 0.4 % of the reading)^2, the rate of each
/// series eliminated. Exposure times are taken as exact, the lamp as steady. `chi2_per_dof` says
/// how well that holds. Fewer than 3 usable series leave the camera linear.
struct ResponseEstimate {
  CameraResponse response;
  double chi2_per_dof = 0.0;
  double chi2_per_dof_linear = 0.0;  ///< with curvature 0 and offset 0
  std::size_t readings = 0;
};
ResponseEstimate estimate_response(const std::vector<ExposureSeries>& series);

}  // namespace truebox

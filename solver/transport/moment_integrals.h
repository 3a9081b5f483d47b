// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "transport/polynomial_element.h"

namespace truebox {

/// Irradiance of a surface element from each polynomial phi_f of `source`, nothing between:
///   sum[f] += 1/pi int cos_x cos_y / r^2 phi_f(y) dA_y.
/// Gauss quadrature on parts of the source that are small compared with their distance, to about
/// `relative_tolerance`. The point may come as near as it likes, but not lie on the source.
void add_gathered_moments(const Vec3& point, const Vec3& normal, const PolynomialElement& source,
                          double relative_tolerance, double* sum);

/// K_fg = 1/pi int int phi_f(x) cos_x cos_y / r^2 phi_g(y) dA_y dA_x, functions of i x functions
/// of j, m^0; (0, 0) is the exchange area over sqrt(A_i A_j). Far pairs by a product of Gauss
/// rules. Near and touching pairs: moments gathered at points of the smaller element, whose Gauss
/// rules are crowded towards the ends of [0, 1] by t^3 (10 - 15 t + 6 t^2) and cut at the feet of
/// the other's corners, so that they resolve r ln r at a common edge: far pairs hold the tolerance,
/// near and touching ones a few 1e-6 at best. Each element must lie wholly on one side of the
/// other's plane.
Eigen::MatrixXd exchange_moments(const PolynomialElement& i, const PolynomialElement& j,
                                 double relative_tolerance);

}  // namespace truebox

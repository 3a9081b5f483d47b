// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "transport/solve_state.h"

namespace truebox {

/// All bands at once, as combinations of few functions of the elements. Each function w lives on
/// elements of one reflectance, so that diag(rho) w is rho w in every band, and F w, which costs
/// only those elements' columns of S, serves all bands:
///   B_k = sum_j y_jk w_j,   y_k by Galerkin's condition, a small symmetric system a band,
///   r_k = M_k + diag(rho_k) sum_j y_jk F w_j - B_k,
/// the true residual, without another pass. Where it is too large, the residuals of a few bands
/// become the next functions. Each band is held to its own bound.
/// False where it is no use: few bands, many reflectances, or residuals that need more functions
/// than pay; b is then the best so far, from which other methods go on.
/// Sources: Prud'homme et al. (2002), reduced bases; Saad (2003), sec. 5.2, projection; Cheng,
/// Gimbutas, Martinsson & Rokhlin (2005), choice of columns.
bool solve_on_reduced_basis(SolveState& state);

}  // namespace truebox

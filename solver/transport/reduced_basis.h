// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "transport/solve_state.h"

namespace truebox {

/// Solves all bands by Galerkin's projection on one space that they share. Where elements share a
/// few materials, bands differ only in those materials' reflectances, and their irradiances lie
/// close to a space of a few dozen vectors, each on one material's elements. It grows by the
/// largest parts of all bands' residuals, eight vectors a pass over S, so that every pass serves
/// every band: a block Krylov method with a different system in each band. Nothing is assumed of
/// the bands: each answer's own residual bounds its error, as everywhere else, and costs no pass.
/// Bands that the space stops helping end with conjugate gradients from where it brought them.
/// Returns false, nothing done, where bands or materials give no saving.
/// Sources: Prud'homme et al. (2002); Rozza, Huynh & Patera (2008), reduced basis with a-posteriori
/// bound; O'Leary (1980), block Krylov spaces.
bool solve_on_reduced_basis(SolveState& state);

}  // namespace truebox

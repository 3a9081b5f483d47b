// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "transport/solve_state.h"

namespace truebox {

/// Solves all bands by conjugate gradients in a few of them and a Galerkin projection of the rest.
/// Where elements share a few materials, bands differ only in those materials' reflectances, and
/// the irradiance of one band lies close to the span of the others', each material's elements
/// taken apart. The basis grows by the worst bands until all meet the request. Nothing is assumed
/// of the bands: each answer's own residual bounds its error, as everywhere else, and costs no pass
/// over S. Returns false, nothing done, where bands or materials give no saving.
/// Sources: Prud'homme et al. (2002); Rozza, Huynh & Patera (2008), reduced basis with a-posteriori
/// bound.
bool solve_on_reduced_basis(SolveState& state);

}  // namespace truebox

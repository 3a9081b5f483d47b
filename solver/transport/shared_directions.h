// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "transport/solve_state.h"

namespace truebox {

/// Conjugate gradients in all bands at once, as solve_conjugate_gradient, but with products of a
/// few bands only. Where spectra are smooth and materials few, the bands' search directions p lie
/// close to a space of some twenty of them, and S p of the others is a combination of theirs. How
/// close that must be is known: what a product misses moves the true residual away from the
/// recurrence's by no more, so that each pass takes as many bands as keep every band's share of
/// its allowed residual, fewer and fewer as residuals fall. What is missed is measured on all
/// elements, not estimated. At the end the true residual decides, its own products' error in the
/// bound; bands that miss it go on from there.
/// Returns false, nothing done, where there are too few bands for that to save a pass.
/// Sources: Simoncini & Szyld (2003) and van den Eshof & Sleijpen (2004), inexact Krylov methods;
/// Cheng, Gimbutas, Martinsson & Rokhlin (2005), interpolative decomposition.
bool solve_on_shared_directions(SolveState& state);

}  // namespace truebox

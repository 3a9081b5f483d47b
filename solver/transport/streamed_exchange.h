// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "transport/found_exchange.h"

namespace truebox {

/// Exchange areas that are never held: each pass over the matrix finds its rows anew, without rays
/// (stream_form_factors), and forgets them. Memory is a row a thread and the radiosity of all bands
/// instead of n^2 numbers; time is that of the form factors for every pass of the solver, doubled
/// because no pair is mirrored. Rows are not scaled to close: `summary` says how far they are off,
/// and that error is in the answer. Elements that lie under a surface are left out as by
/// form_factors.
FindExchange streamed_exchange();

/// Processor time of a solve so, relative to the same with the matrix held: `passes` of the solver,
/// one to see which rows close, over both halves.
inline double streamed_slowdown(double passes) { return 2.0 * (passes + 1.0); }

}  // namespace truebox

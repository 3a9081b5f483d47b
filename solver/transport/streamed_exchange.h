// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "transport/found_exchange.h"

namespace truebox {

/// For PredictOptions: form factors of exact visibility that are found anew for every pass, the
/// same numbers as the full matrix to the solver's digits. Memory is O(n) beside the mesh; every
/// pass costs the time of two matrices, for nothing is mirrored. Closure is scaled as
/// repair_closure does it, by the scale factors alone: x_i x_j S_ij on partly hidden pairs, found
/// by Newton's method on log x, each step by conjugate gradients (Knight & Ruiz 2013). The summary
/// counts the passes that this took. Bands are best solved together (SolveOptions::share_bands =
/// false): a pass costs the same for one as for all. The request must outlive the exchange.
FoundExchange streamed_exchange(const ExchangeRequest& request);

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "transport/solve_state.h"

namespace truebox {

using Eigen::Index;

void solve_jacobi(SolveState& s) {
  while (true) {
    const BandMatrix r = s.residual();
    if (s.meets_bound(r)) {
      s.summary.outcome = SolveOutcome::converged;
      return;
    }
    if (s.diverged() || s.out_of_iterations()) return;
    s.b += r;
    ++s.summary.iterations;
    s.tell();
  }
}

// Bands are independent: each thread sweeps its own. The change of a sweep bounds its error as the
// residual does, ||B - B~|| <= q / (1 - q) ||change||, so that no pass is spent on residuals before
// the last. Source: Varga (1962), ch. 3.
void solve_gauss_seidel(SolveState& s) {
  while (!s.out_of_iterations()) {
    const BandMatrix before = s.b;
    tbb::parallel_for(
        tbb::blocked_range<Index>(0, s.bands(), std::max<Index>(1, (s.bands() + 1) / 2)),
        [&](const auto& range) {
          const Index first = range.begin(), count = range.end() - range.begin();
          auto part = s.b.middleCols(first, count);
          Eigen::VectorXd row(s.elements());
          Eigen::RowVectorXd gathered(count);
          for (Index i = 0; i < s.elements(); ++i) {
            s.exchange.row(i, row);
            gathered.noalias() = row.transpose() * part;
            part.row(i) = s.source.row(i).middleCols(first, count).array() +
                          s.rho.row(i).middleCols(first, count).array() * gathered.array() /
                              s.exchange.area_m2()[i];
          }
        },
        tbb::simple_partitioner());
    ++s.summary.iterations;
    s.summary.matrix_passes += 1.0;
    s.tell();
    if (s.meets_bound(s.b - before) && s.finish()) return;
    if (s.diverged()) return;
  }
  s.finish();
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "transport/solve_state.h"

namespace truebox {

using Eigen::Index;

// Symmetrised: (diag(A / rho) - S) B = diag(A / rho) M, scaled by its diagonal; black elements keep
// B = M. Source: Neumann (1994).
void solve_conjugate_gradient(SolveState& s) {
  const Index n = s.elements(), m = s.bands();
  BandMatrix inverse_d(n, m);  // rho / A
  for (Index i = 0; i < n; ++i) inverse_d.row(i) = s.rho.row(i) / s.exchange.area_m2()[i];
  BandMatrix r = s.residual();
  BandMatrix p = r;  // preconditioned residual D^-1 (D r): the radiosity residual itself
  const auto weighted_dot = [&](const BandMatrix& x, const BandMatrix& y) {
    Eigen::ArrayXd sum = Eigen::ArrayXd::Zero(m);
    for (Index i = 0; i < n; ++i)
      for (Index k = 0; k < m; ++k)
        if (inverse_d(i, k) > 0.0) sum[k] += x(i, k) * y(i, k) / inverse_d(i, k);
    return sum;
  };
  Eigen::ArrayXd rz = weighted_dot(r, r);
  if (s.meets_bound(r)) {
    s.summary.outcome = SolveOutcome::converged;
    return;
  }
  while (!s.diverged() && !s.out_of_iterations()) {
    BandMatrix ap = s.exchange.product(p);
    s.summary.matrix_passes += 1.0;
    ap = p - inverse_d.cwiseProduct(ap);  // D^-1 (D - S) p
    const Eigen::ArrayXd pap = weighted_dot(p, ap);
    Eigen::ArrayXd alpha(m), beta(m);
    for (Index k = 0; k < m; ++k) alpha[k] = pap[k] > 0.0 ? rz[k] / pap[k] : 0.0;
    for (Index i = 0; i < n; ++i) {
      s.b.row(i).array() += alpha.transpose() * p.row(i).array();
      r.row(i).array() -= alpha.transpose() * ap.row(i).array();
    }
    ++s.summary.iterations;
    s.tell();
    // The recurrence drifts: the true residual decides, and restarts it when it claims success.
    const bool claims = s.meets_bound(r);
    if (claims) {
      r = s.residual();
      if (s.meets_bound(r)) {
        s.summary.outcome = SolveOutcome::converged;
        return;
      }
    }
    const Eigen::ArrayXd next = weighted_dot(r, r);
    for (Index k = 0; k < m; ++k) beta[k] = claims || rz[k] == 0.0 ? 0.0 : next[k] / rz[k];
    rz = next;
    for (Index i = 0; i < n; ++i) p.row(i) = r.row(i).array() + beta.transpose() * p.row(i).array();
  }
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "transport/solve_radiosity.h"

namespace truebox {

/// What the solution methods share: the system, its residual, and the bound that ends the work.
class SolveState {
 public:
  /// `radiosity` holds the first guess.
  SolveState(const ExchangeOperator& exchange, const BandMatrix& rho, const BandMatrix& source,
             const SolveOptions& options, BandMatrix& radiosity, const Progress& progress);

  Eigen::Index elements() const { return rho.rows(); }
  Eigen::Index bands() const { return rho.cols(); }

  /// q = max rho * max row sum of a band: each bounce keeps no more than this.
  double contraction(Eigen::Index band) const { return contraction_[band]; }

  /// M + diag(rho) F B - B: one pass.
  BandMatrix residual();
  /// Notes a residual in the history and sets the bound, ||r|| times `factor` / (1 - q) in each
  /// band; true if every band meets the request. Says so in the summary if it is no number.
  bool meets_bound(const BandMatrix& r, double factor = 1.0);
  /// meets_bound of the true residual, and `converged` in the summary if so.
  bool finish();
  bool out_of_iterations();
  bool diverged() const { return summary.outcome == SolveOutcome::diverged; }
  /// Tells options.on_progress.
  void tell() const;
  const Progress& progress() const { return progress_; }

  const ExchangeOperator& exchange;
  const BandMatrix& rho;
  const BandMatrix& source;
  const SolveOptions& options;
  BandMatrix& b;
  BandMatrix gathered;  ///< S B as the last residual saw it
  SolveSummary summary;

 private:
  const Progress& progress_;
  Eigen::VectorXd contraction_;
};

void solve_direct(SolveState& state);
void solve_jacobi(SolveState& state);
void solve_gauss_seidel(SolveState& state);
void solve_southwell(SolveState& state, bool ambient);
void solve_conjugate_gradient(SolveState& state);
void solve_gmres(SolveState& state);
void solve_bicgstab(SolveState& state);

}  // namespace truebox

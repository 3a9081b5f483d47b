// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>

#include "transport/prediction.h"

namespace truebox {

/// Wall-clock seconds, the slowest rank's, over all grids solved so far.
struct DistributedTimes {
  double form_factors_s = 0.0;
  double solve_s = 0.0;
  std::size_t rows_bytes = 0;  ///< of form factors that the fullest rank held
};

/// One process of a solve that is spread over the ranks of MPI; there may be one in a process. The
/// rows of the form factors stay where they were found, vectors of n numbers travel. Krylov methods
/// are PETSc's, on a shell matrix: conjugate gradients with Jacobi's preconditioner unless its own
/// options say otherwise. In every band, n x bands, W m^-2 nm^-1, scaled to sources of 1:
///   diag(A / rho) B - S B = diag(A / rho) M,
/// with the a-posteriori bound of solve_radiosity. Source: Balay et al. (1997), PETSc.
class DistributedRun {
 public:
  /// Starts MPI and PETSc. `petsc_options` are PETSc's own, as on a command line
  /// ("-ksp_type gmres -ksp_monitor"); those in PETSC_OPTIONS count as well.
  explicit DistributedRun(const std::string& petsc_options);
  ~DistributedRun();
  DistributedRun(const DistributedRun&) = delete;
  DistributedRun& operator=(const DistributedRun&) = delete;

  int rank() const;
  int size() const;
  const DistributedTimes& times() const;

  /// For PredictOptions. All ranks must predict the same scene with the same options; each holds
  /// the whole solution afterwards, none the whole matrix. Form factors are those of exact
  /// visibility. Throws std::length_error, on every rank, if a rank's rows exceed the memory limit,
  /// std::runtime_error where PETSc fails.
  SolveGrid solve_grid();

  /// Ends all ranks at once with `exit_code`: for an error that the others do not know of.
  [[noreturn]] void abort(int exit_code);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace truebox

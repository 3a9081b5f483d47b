// SPDX-License-Identifier: BSD-3-Clause
#include "distributed/distributed_run.h"

#include <petscksp.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "distributed/distributed_rows.h"

namespace truebox {
namespace {

using distributed::DistributedRows;
using distributed::Partition;
using Eigen::Index;
using Eigen::VectorXd;

void check(PetscErrorCode code) {
  if (code == 0) return;
  const char* text = nullptr;
  PetscErrorMessage(code, &text, nullptr);
  throw std::runtime_error(std::string("PETSc: ") + (text ? text : "an unknown error"));
}

// diag(A / rho) B - S B = diag(A / rho) M, symmetric and positive definite as q < 1. Where rho = 0
// nothing is reflected: the row is that of the identity, the column empty.
struct BandSystem {
  const Partition& partition;
  const DistributedRows& rows;
  VectorXd diagonal;         // of the local rows, m^2
  std::vector<char> active;  // of all n
  mutable VectorXd whole;
  mutable int products = 0;

  void apply(const double* x, double* y) const {
    partition.gather(x, whole);
    for (Index j = 0; j < whole.size(); ++j)
      if (!active[static_cast<std::size_t>(j)]) whole[j] = 0.0;
    Eigen::Map<VectorXd> result(y, partition.local());
    result.noalias() = rows.exchange_area_m2() * whole;
    for (Index k = 0; k < result.size(); ++k)
      result[k] = active[static_cast<std::size_t>(partition.begin() + k)]
                      ? diagonal[k] * x[k] - result[k]
                      : x[k];
    ++products;
  }
};

PetscErrorCode multiply(Mat matrix, Vec in, Vec out) {
  BandSystem* system = nullptr;
  PetscCall(MatShellGetContext(matrix, &system));
  const PetscScalar* x = nullptr;
  PetscScalar* y = nullptr;
  PetscCall(VecGetArrayRead(in, &x));
  PetscCall(VecGetArrayWrite(out, &y));
  system->apply(x, y);
  PetscCall(VecRestoreArrayWrite(out, &y));
  PetscCall(VecRestoreArrayRead(in, &x));
  return 0;
}

PetscErrorCode copy_diagonal(Mat matrix, Vec out) {
  BandSystem* system = nullptr;
  PetscCall(MatShellGetContext(matrix, &system));
  PetscScalar* y = nullptr;
  PetscCall(VecGetArrayWrite(out, &y));
  std::copy_n(system->diagonal.data(), system->diagonal.size(), y);
  PetscCall(VecRestoreArrayWrite(out, &y));
  return 0;
}

// PETSc's objects of one system, released together.
class Krylov {
 public:
  explicit Krylov(BandSystem& system) {
    const auto local = static_cast<PetscInt>(system.partition.local());
    const auto all = static_cast<PetscInt>(system.partition.rows());
    check(MatCreateShell(system.partition.comm(), local, local, all, all, &system, &matrix_));
    check(MatShellSetOperation(matrix_, MATOP_MULT, reinterpret_cast<void (*)()>(multiply)));
    check(MatShellSetOperation(matrix_, MATOP_GET_DIAGONAL,
                               reinterpret_cast<void (*)()>(copy_diagonal)));
    check(MatSetOption(matrix_, MAT_SYMMETRIC, PETSC_TRUE));
    check(MatCreateVecs(matrix_, &x_, &b_));
    check(KSPCreate(system.partition.comm(), &solver_));
    check(KSPSetOperators(solver_, matrix_, matrix_));
    check(KSPSetType(solver_, KSPCG));
    PC preconditioner = nullptr;
    check(KSPGetPC(solver_, &preconditioner));
    check(PCSetType(preconditioner, PCJACOBI));
    check(KSPSetInitialGuessNonzero(solver_, PETSC_TRUE));
    check(KSPSetFromOptions(solver_));
  }
  ~Krylov() {
    KSPDestroy(&solver_);
    VecDestroy(&b_);
    VecDestroy(&x_);
    MatDestroy(&matrix_);
  }
  Krylov(const Krylov&) = delete;
  Krylov& operator=(const Krylov&) = delete;

  // Improves `x`; returns false if PETSc did not get there.
  bool solve(const VectorXd& right_hand_side, double relative, int limit, VectorXd& x,
             int& iterations) {
    copy(right_hand_side, b_);
    copy(x, x_);
    check(KSPSetTolerances(solver_, relative, PETSC_DEFAULT, PETSC_DEFAULT, limit));
    check(KSPSolve(solver_, b_, x_));
    const PetscScalar* values = nullptr;
    check(VecGetArrayRead(x_, &values));
    std::copy_n(values, x.size(), x.data());
    check(VecRestoreArrayRead(x_, &values));
    PetscInt taken = 0;
    check(KSPGetIterationNumber(solver_, &taken));
    iterations += static_cast<int>(taken);
    KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
    check(KSPGetConvergedReason(solver_, &reason));
    return reason > 0;
  }

 private:
  static void copy(const VectorXd& from, Vec to) {
    PetscScalar* values = nullptr;
    check(VecGetArrayWrite(to, &values));
    std::copy_n(from.data(), from.size(), values);
    check(VecRestoreArrayWrite(to, &values));
  }

  Mat matrix_ = nullptr;
  Vec x_ = nullptr, b_ = nullptr;
  KSP solver_ = nullptr;
};

// One band. The bound is a posteriori, as in solve_radiosity.
void solve_band(const Partition& partition, const DistributedRows& rows, const BandMatrix& rho,
                const BandMatrix& source, Index band, const SolveOptions& options,
                GridSolution& grid) {
  const Index begin = partition.begin(), local = partition.local();
  BandSystem system{partition, rows, VectorXd::Ones(local), {}, {}, 0};
  system.active.resize(static_cast<std::size_t>(partition.rows()));
  for (Index j = 0; j < partition.rows(); ++j)
    system.active[static_cast<std::size_t>(j)] = rho(j, band) > 0.0;
  VectorXd right(local), b(local);
  for (Index k = 0; k < local; ++k) {
    const Index i = begin + k;
    if (rho(i, band) > 0.0) system.diagonal[k] = rows.area_m2()[i] / rho(i, band);
    right[k] = system.diagonal[k] * source(i, band);
    b[k] = source(i, band);
  }
  const double q = rho.col(band).maxCoeff() * rows.summary().row_sum_max;
  if (!(q < 1.0)) throw std::invalid_argument("reflectances must stay below 1: energy grows");
  Krylov krylov(system);
  VectorXd irradiance(local), whole;
  double relative = 0.1 * options.relative_bound * (1.0 - q), bound = 0.0;
  bool is_done = false;
  for (int attempt = 0; attempt < 6 && !is_done; ++attempt, relative *= 0.01) {
    const bool converged = krylov.solve(right, std::max(relative, 1e-15), options.iteration_limit,
                                        b, grid.solve.iterations);
    partition.gather(b.data(), whole);
    irradiance.noalias() = rows.exchange_area_m2() * whole;
    double residual = 0.0;
    for (Index k = 0; k < local; ++k) {
      irradiance[k] /= rows.area_m2()[begin + k];
      residual = std::max(residual, std::abs(source(begin + k, band) +
                                             rho(begin + k, band) * irradiance[k] - b[k]));
    }
    bound = partition.max(residual) / (1.0 - q);
    is_done = bound <= options.relative_bound * whole.cwiseAbs().maxCoeff();
    if (!converged) break;
  }
  grid.solve.error_bound[band] = bound;
  grid.solve.matrix_passes += system.products;
  if (!is_done) grid.solve.outcome = SolveOutcome::iteration_limit;
  grid.reflected.col(band) = whole;
  partition.gather(irradiance.data(), whole);
  grid.indirect.col(band) = whole;
}

}  // namespace

struct DistributedRun::State {
  int rank = 0, size = 1;
  DistributedTimes times;
};

DistributedRun::DistributedRun(const std::string& petsc_options)
    : state_(std::make_unique<State>()) {
  check(PetscInitializeNoArguments());
  PetscPushErrorHandler(PetscReturnErrorHandler, nullptr);  // told by exception, once
  check(PetscOptionsInsertString(nullptr, petsc_options.c_str()));
  MPI_Comm_rank(PETSC_COMM_WORLD, &state_->rank);
  MPI_Comm_size(PETSC_COMM_WORLD, &state_->size);
}

DistributedRun::~DistributedRun() { PetscFinalize(); }

int DistributedRun::rank() const { return state_->rank; }
int DistributedRun::size() const { return state_->size; }
const DistributedTimes& DistributedRun::times() const { return state_->times; }

void DistributedRun::abort(int exit_code) {
  MPI_Abort(PETSC_COMM_WORLD, exit_code);
  std::abort();
}

SolveGrid DistributedRun::solve_grid() {
  return [state = state_.get()](const GridTask& task, GridSolution& grid) {
    const BandMatrix& rho = task.rho;
    const Partition partition(PETSC_COMM_WORLD, grid.mesh.size());
    const double start_s = MPI_Wtime();
    const DistributedRows rows(partition, grid.mesh, task.scene, task.form_factors);
    const double solve_start_s = MPI_Wtime();
    grid.usable = rows.usable();
    grid.form_factors = rows.summary();
    grid.solve = {};
    grid.solve.outcome = SolveOutcome::converged;
    grid.solve.error_bound.resize(rho.cols());
    grid.reflected.resize(rho.rows(), rho.cols());
    grid.indirect.resize(rho.rows(), rho.cols());
    for (Index band = 0; band < rho.cols(); ++band)
      solve_band(partition, rows, rho, task.source, band, task.solve, grid);
    grid.solve.matrix_passes /= static_cast<double>(rho.cols());
    state->times.form_factors_s += partition.max(solve_start_s - start_s);
    state->times.solve_s += partition.max(MPI_Wtime() - solve_start_s);
    state->times.rows_bytes = std::max(
        state->times.rows_bytes,
        static_cast<std::size_t>(partition.max(static_cast<double>(partition.local()) *
                                               static_cast<double>(partition.rows()) * 8.0)));
  };
}

}  // namespace truebox

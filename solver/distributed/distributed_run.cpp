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

// diag(A / rho) B - S B = diag(A / rho) M for every band, symmetric and positive definite as q < 1;
// one system, so that ranks wait for each other once a step and not once a step and band. Where
// rho = 0 nothing is reflected: the row is that of the identity, the column empty.
struct BandSystems {
  const Partition& partition;
  const DistributedRows& rows;
  BandMatrix diagonal;  // of the local rows, m^2
  BandMatrix active;    // of all n: 1, or 0 where rho = 0
  mutable BandMatrix whole;
  mutable int products = 0;

  Index bands() const { return diagonal.cols(); }

  // S x of the local rows, x given on them; nothing comes from where rho = 0 if `masked`.
  BandMatrix exchange(const double* x, bool masked) const {
    partition.gather(x, bands(), whole);
    if (masked) whole = whole.cwiseProduct(active);
    ++products;
    return rows.exchange_area_m2() * whole;
  }

  void apply(const double* x, double* y) const {
    const Eigen::Map<const BandMatrix> from(x, partition.local(), bands());
    Eigen::Map<BandMatrix> to(y, partition.local(), bands());
    const auto own = active.middleRows(partition.begin(), partition.local());
    const BandMatrix received = exchange(x, true);
    to = diagonal.cwiseProduct(from) - own.cwiseProduct(received);
  }
};

PetscErrorCode multiply(Mat matrix, Vec in, Vec out) {
  BandSystems* system = nullptr;
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
  BandSystems* system = nullptr;
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
  explicit Krylov(BandSystems& system) {
    const auto local = static_cast<PetscInt>(system.partition.local() * system.bands());
    const auto all = static_cast<PetscInt>(system.partition.rows() * system.bands());
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
  bool solve(const BandMatrix& right_hand_side, double relative, int limit, BandMatrix& x,
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
  static void copy(const BandMatrix& from, Vec to) {
    PetscScalar* values = nullptr;
    check(VecGetArrayWrite(to, &values));
    std::copy_n(from.data(), from.size(), values);
    check(VecRestoreArrayWrite(to, &values));
  }

  Mat matrix_ = nullptr;
  Vec x_ = nullptr, b_ = nullptr;
  KSP solver_ = nullptr;
};

// All bands, each scaled to a source of 1 at most, so that none is lost beside brighter ones. The
// bound of each is a posteriori, as in solve_radiosity.
void solve_bands(const Partition& partition, const DistributedRows& rows, const BandMatrix& rho,
                 const BandMatrix& source, const SolveOptions& options, GridSolution& grid) {
  const Index begin = partition.begin(), local = partition.local(), bands = rho.cols();
  BandSystems system{partition, rows, BandMatrix::Ones(local, bands), {}, {}, 0};
  system.active = (rho.array() > 0.0).cast<double>();
  const VectorXd area = rows.area_m2().segment(begin, local);
  const BandMatrix own_rho = rho.middleRows(begin, local);
  for (Index k = 0; k < local; ++k)
    for (Index b = 0; b < bands; ++b)
      if (own_rho(k, b) > 0.0) system.diagonal(k, b) = area[k] / own_rho(k, b);
  Eigen::RowVectorXd scale = source.cwiseAbs().colwise().maxCoeff();
  scale = (scale.array() > 0.0).select(scale, 1.0);
  const BandMatrix own = source.middleRows(begin, local).array().rowwise() / scale.array();
  const BandMatrix right = system.diagonal.cwiseProduct(own);
  const Eigen::RowVectorXd q = rho.colwise().maxCoeff() * rows.summary().row_sum_max;
  if (!(q.maxCoeff() < 1.0))
    throw std::invalid_argument("reflectances must stay below 1: energy grows");

  Krylov krylov(system);
  BandMatrix x = own, irradiance, whole;
  Eigen::RowVectorXd bound(bands);
  double relative = 0.1 * options.relative_bound * (1.0 - q.maxCoeff());
  bool is_done = false;
  for (int attempt = 0; attempt < 6 && !is_done; ++attempt, relative *= 0.01) {
    const bool converged = krylov.solve(right, std::max(relative, 1e-15), options.iteration_limit,
                                        x, grid.solve.iterations);
    irradiance = system.exchange(x.data(), false);
    irradiance = irradiance.array().colwise() / area.array();
    const BandMatrix residual = own + own_rho.cwiseProduct(irradiance) - x;
    for (Index b = 0; b < bands; ++b)
      bound[b] =
          partition.max(local > 0 ? residual.col(b).cwiseAbs().maxCoeff() : 0.0) / (1.0 - q[b]);
    partition.gather(x.data(), bands, whole);
    const Eigen::RowVectorXd wanted =
        options.relative_bound * whole.cwiseAbs().colwise().maxCoeff();
    is_done = (bound.array() <= wanted.array()).all();
    if (!converged) break;
  }
  if (!is_done) grid.solve.outcome = SolveOutcome::iteration_limit;
  grid.solve.matrix_passes = system.products;
  grid.solve.error_bound = bound.cwiseProduct(scale).transpose();
  grid.reflected = whole.array().rowwise() * scale.array();
  partition.gather(irradiance.data(), bands, whole);
  grid.indirect = whole.array().rowwise() * scale.array();
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
    const Partition partition(PETSC_COMM_WORLD, grid.mesh.size());
    const double start_s = MPI_Wtime();
    const DistributedRows rows(partition, grid.mesh, task.scene, task.form_factors);
    const double solve_start_s = MPI_Wtime();
    grid.usable = rows.usable();
    task.take_free_areas(rows.area_m2());
    grid.form_factors = rows.summary();
    solve_with_near_sources(task, grid, [&](const BandMatrix& source, const SolveOptions& options) {
      grid.solve = {};
      grid.solve.outcome = SolveOutcome::converged;
      solve_bands(partition, rows, task.rho, source, options, grid);
    });
    state->times.form_factors_s += partition.max(solve_start_s - start_s);
    state->times.solve_s += partition.max(MPI_Wtime() - solve_start_s);
    state->times.rows_bytes = std::max(
        state->times.rows_bytes,
        static_cast<std::size_t>(partition.max(static_cast<double>(partition.local()) *
                                               static_cast<double>(partition.rows()) * 8.0)));
  };
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
// The solvers that Eigen has: a factorisation, and Krylov methods for systems without symmetry.
#include <Eigen/Cholesky>
#include <Eigen/IterativeLinearSolvers>
#include <stdexcept>
#include <unsupported/Eigen/IterativeSolvers>

#include "transport/solve_state.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr Index kDirectLimit = 4000;  // a factor of 128 MB and 2e10 operations a band
constexpr Index kRestart = 60;        // GMRES keeps as many vectors
constexpr int kTightenings = 6;       // of the method's own tolerance, before it is given up

}  // namespace

class RadiosityMatrix;

}  // namespace truebox

template <>
struct Eigen::internal::traits<truebox::RadiosityMatrix>
    : public Eigen::internal::traits<Eigen::SparseMatrix<double>> {};

namespace truebox {

// I - diag(rho) F of one band, known by its products alone.
class RadiosityMatrix : public Eigen::EigenBase<RadiosityMatrix> {
 public:
  using Scalar = double;
  using RealScalar = double;
  using StorageIndex = int;
  enum {
    ColsAtCompileTime = Eigen::Dynamic,
    MaxColsAtCompileTime = Eigen::Dynamic,
    IsRowMajor = false
  };

  RadiosityMatrix(SolveState& state, Index band) : state_(&state), band_(band) {}

  Index rows() const { return state_->elements(); }
  Index cols() const { return state_->elements(); }

  template <class Rhs>
  Eigen::Product<RadiosityMatrix, Rhs, Eigen::AliasFreeProduct> operator*(
      const Eigen::MatrixBase<Rhs>& x) const {
    return {*this, x.derived()};
  }

  Eigen::VectorXd apply(const Eigen::VectorXd& x) const {
    state_->summary.matrix_passes += 1.0 / static_cast<double>(state_->bands());
    const BandMatrix product = state_->exchange.product(x);
    return x - state_->rho.col(band_)
                   .cwiseProduct(product.col(0))
                   .cwiseQuotient(state_->exchange.area_m2());
  }

 private:
  SolveState* state_;
  Index band_;
};

namespace {

template <class Method>
void solve_by(SolveState& s) {
  double share = 0.1;  // of the request: the methods measure another norm than the bound
  for (int attempt = 0; attempt < kTightenings; ++attempt, share *= 0.1) {
    int steps = 0;
    for (Index band = 0; band < s.bands(); ++band) {
      const RadiosityMatrix matrix(s, band);
      Method method;
      if constexpr (requires { method.set_restart(1); })
        method.set_restart(std::min(kRestart, s.elements()));
      method.compute(matrix);
      method.setTolerance(share * s.options.relative_bound * (1.0 - s.contraction(band)));
      method.setMaxIterations(s.options.iteration_limit);
      const Eigen::VectorXd emission = s.source.col(band), guess = s.b.col(band);
      if (emission.isZero(0.0)) continue;
      s.b.col(band) =
          (s.rho.col(band).array() > 0.0).select(method.solveWithGuess(emission, guess), emission);
      steps = std::max(steps, static_cast<int>(method.iterations()));
    }
    s.summary.iterations += steps;
    s.tell();
    if (s.finish() || s.diverged()) return;
    if (s.out_of_iterations()) return;
  }
  s.summary.outcome = SolveOutcome::iteration_limit;
}

}  // namespace
}  // namespace truebox

template <typename Rhs>
struct Eigen::internal::generic_product_impl<truebox::RadiosityMatrix, Rhs, Eigen::SparseShape,
                                             Eigen::DenseShape, Eigen::GemvProduct>
    : generic_product_impl_base<truebox::RadiosityMatrix, Rhs,
                                generic_product_impl<truebox::RadiosityMatrix, Rhs>> {
  template <typename Destination>
  static void scaleAndAddTo(Destination& destination, const truebox::RadiosityMatrix& matrix,
                            const Rhs& x, const double& scale) {
    destination.noalias() += scale * matrix.apply(x);
  }
};

namespace truebox {

void solve_gmres(SolveState& s) {
  solve_by<Eigen::GMRES<RadiosityMatrix, Eigen::IdentityPreconditioner>>(s);
}

void solve_bicgstab(SolveState& s) {
  solve_by<Eigen::BiCGSTAB<RadiosityMatrix, Eigen::IdentityPreconditioner>>(s);
}

// I - C with C = sqrt(rho / A) S sqrt(rho / A) is symmetric and positive definite, black elements
// included; y = sqrt(rho / A) S B gives B = M + sqrt(rho / A) y.
void solve_direct(SolveState& s) {
  const Index n = s.elements();
  if (n > kDirectLimit)
    throw std::length_error("direct factorisation of " + std::to_string(n) + " elements: at most " +
                            std::to_string(kDirectLimit) + "; an iterative method takes more");
  Eigen::MatrixXd exchange(n, n);
  Eigen::VectorXd row(n);
  for (Index i = 0; i < n; ++i) {
    s.exchange.row(i, row);
    exchange.col(i) = row;
  }
  s.summary.matrix_passes += 1.0;
  for (Index band = 0; band < s.bands(); ++band) {
    const Eigen::VectorXd scale = s.rho.col(band).cwiseQuotient(s.exchange.area_m2()).cwiseSqrt();
    Eigen::MatrixXd matrix = -(scale.asDiagonal() * exchange * scale.asDiagonal());
    matrix.diagonal().array() += 1.0;
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(matrix);
    const auto correct = [&](const Eigen::VectorXd& emission) -> Eigen::VectorXd {
      const Eigen::VectorXd y = factor.solve((scale.asDiagonal() * (exchange * emission)).eval());
      return emission + scale.cwiseProduct(y);
    };
    s.b.col(band) = correct(s.source.col(band));
    // One step of iterative refinement takes off the factor's rounding (Higham 2002, ch. 12).
    const Eigen::VectorXd r = s.source.col(band) - s.b.col(band) +
                              scale.cwiseAbs2().cwiseProduct(exchange * s.b.col(band));
    s.b.col(band) += correct(r);
  }
  s.summary.iterations = 1;
  s.tell();
  if (!s.finish() && !s.diverged()) s.summary.outcome = SolveOutcome::iteration_limit;
}

}  // namespace truebox

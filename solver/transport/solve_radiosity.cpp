// SPDX-License-Identifier: BSD-3-Clause
#include "transport/solve_radiosity.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "transport/band_product.h"

namespace truebox {
namespace {

using Eigen::Index;

class Solver {
 public:
  Solver(const FormFactors& factors, const BandMatrix& rho, const BandMatrix& source,
         const SolveOptions& options, BandMatrix& radiosity, const Progress& progress)
      : factors_(factors),
        rho_(rho),
        source_(source),
        options_(options),
        b_(radiosity),
        progress_(progress) {}

  SolveSummary run() {
    summary_.error_bound =
        Eigen::VectorXd::Constant(rho_.cols(), std::numeric_limits<double>::infinity());
    b_ = source_;
    if (options_.method == SolveMethod::gauss_seidel)
      gauss_seidel();
    else
      conjugate_gradient();
    return std::move(summary_);
  }

 private:
  BandMatrix residual() {
    BandMatrix r = band_product(factors_.exchange_area_m2, b_);
    ++summary_.matrix_passes;
    for (Index i = 0; i < r.rows(); ++i)
      r.row(i) = source_.row(i).array() +
                 rho_.row(i).array() * r.row(i).array() / factors_.area_m2[i] - b_.row(i).array();
    return r;
  }

  // Updates bound and history from a true residual; true when every band meets the request.
  bool good_enough(const BandMatrix& r) {
    if (!r.allFinite()) {  // maxCoeff may pass over a NaN
      summary_.outcome = SolveOutcome::diverged;
      summary_.error_bound.setConstant(std::numeric_limits<double>::infinity());
      return false;
    }
    double worst = 0.0, worst_bound = 0.0;
    for (Index band = 0; band < r.cols(); ++band) {
      const double q = rho_.col(band).maxCoeff() * std::max(1.0, factors_.summary.row_sum_max);
      const double norm = b_.col(band).cwiseAbs().maxCoeff();
      const double size = r.col(band).cwiseAbs().maxCoeff();
      summary_.error_bound[band] =
          q < 1.0 ? size / (1.0 - q) : std::numeric_limits<double>::infinity();
      if (norm == 0.0 && size == 0.0) continue;
      worst = std::max(worst, size / norm);
      worst_bound = std::max(worst_bound, summary_.error_bound[band] / norm);
    }
    summary_.residual_history.push_back(worst);
    if (!std::isfinite(worst)) summary_.outcome = SolveOutcome::diverged;
    if (progress_) {
      const double wanted = std::log(options_.relative_bound);
      progress_("radiosity",
                std::clamp(std::log(std::max(worst_bound, 1e-300)) / wanted, 0.0, 1.0));
    }
    return worst_bound <= options_.relative_bound;
  }

  // Bands are independent: each thread sweeps its own.
  void gauss_seidel() {
    while (summary_.iterations < options_.iteration_limit) {
      tbb::parallel_for(
          tbb::blocked_range<Index>(0, b_.cols(), std::max<Index>(1, (b_.cols() + 1) / 2)),
          [&](const auto& range) {
            auto part = b_.middleCols(range.begin(), range.end() - range.begin());
            Eigen::RowVectorXd gathered(part.cols());
            for (Index i = 0; i < b_.rows(); ++i) {
              // S is symmetric: its column is its row, and contiguous.
              gathered.noalias() = factors_.exchange_area_m2.col(i).transpose() * part;
              part.row(i) = source_.row(i).middleCols(range.begin(), part.cols()).array() +
                            rho_.row(i).middleCols(range.begin(), part.cols()).array() *
                                gathered.array() / factors_.area_m2[i];
            }
          },
          tbb::simple_partitioner());
      ++summary_.iterations;
      ++summary_.matrix_passes;
      if (good_enough(residual())) {
        summary_.outcome = SolveOutcome::converged;
        return;
      }
      if (summary_.outcome == SolveOutcome::diverged) return;
    }
    summary_.outcome = SolveOutcome::iteration_limit;
  }

  void conjugate_gradient() {
    const Index n = b_.rows(), m = b_.cols();
    // Black elements keep B = M; in the others D = A / rho scales the system to unit diagonal.
    BandMatrix inverse_d(n, m);
    for (Index i = 0; i < n; ++i) inverse_d.row(i) = rho_.row(i) / factors_.area_m2[i];
    BandMatrix r = residual();
    BandMatrix z = r;  // preconditioned residual D^-1 (D r): the radiosity residual itself
    BandMatrix p = z;
    const auto weighted_dot = [&](const BandMatrix& x, const BandMatrix& y) {
      Eigen::ArrayXd sum = Eigen::ArrayXd::Zero(m);
      for (Index i = 0; i < n; ++i)
        for (Index k = 0; k < m; ++k)
          if (inverse_d(i, k) > 0.0) sum[k] += x(i, k) * y(i, k) / inverse_d(i, k);
      return sum;
    };
    Eigen::ArrayXd rz = weighted_dot(r, z);
    if (good_enough(r)) {
      summary_.outcome = SolveOutcome::converged;
      return;
    }
    if (summary_.outcome == SolveOutcome::diverged) return;
    while (summary_.iterations < options_.iteration_limit) {
      BandMatrix ap = band_product(factors_.exchange_area_m2, p);
      ++summary_.matrix_passes;
      ap = p - inverse_d.cwiseProduct(ap);  // D^-1 (D - S) p
      const Eigen::ArrayXd pap = weighted_dot(p, ap);
      Eigen::ArrayXd alpha(m), beta(m);
      for (Index k = 0; k < m; ++k) alpha[k] = pap[k] > 0.0 ? rz[k] / pap[k] : 0.0;
      for (Index i = 0; i < n; ++i) {
        b_.row(i).array() += alpha.transpose() * p.row(i).array();
        r.row(i).array() -= alpha.transpose() * ap.row(i).array();
      }
      ++summary_.iterations;
      // The recurrence drifts: the true residual decides, and restarts it when it claims success.
      const bool claims = good_enough(r);
      if (claims) {
        r = residual();
        if (good_enough(r)) {
          summary_.outcome = SolveOutcome::converged;
          return;
        }
      }
      if (summary_.outcome == SolveOutcome::diverged) return;
      const Eigen::ArrayXd next = weighted_dot(r, r);
      for (Index k = 0; k < m; ++k) beta[k] = claims || rz[k] == 0.0 ? 0.0 : next[k] / rz[k];
      rz = next;
      for (Index i = 0; i < n; ++i)
        p.row(i) = r.row(i).array() + beta.transpose() * p.row(i).array();
    }
    summary_.outcome = SolveOutcome::iteration_limit;
  }

  const FormFactors& factors_;
  const BandMatrix& rho_;
  const BandMatrix& source_;
  const SolveOptions& options_;
  BandMatrix& b_;
  const Progress& progress_;
  SolveSummary summary_;
};

}  // namespace

std::string SolveOptions::invalid() const {
  if (!(relative_bound > 0.0 && relative_bound < 1.0)) return "relative_bound must lie in (0, 1)";
  if (iteration_limit < 1) return "iteration_limit must be positive";
  return {};
}

std::string SolveSummary::brief() const {
  static const char* const kNames[] = {"not run", "converged", "iteration limit", "diverged"};
  return std::string(kNames[static_cast<int>(outcome)]) + " after " + std::to_string(iterations) +
         " iterations, " + std::to_string(matrix_passes) + " passes over the form factors";
}

SolveSummary solve_radiosity(const FormFactors& factors, const BandMatrix& rho,
                             const BandMatrix& source, const SolveOptions& options,
                             BandMatrix& radiosity, const Progress& progress) {
  if (const std::string why = options.invalid(); !why.empty()) throw std::invalid_argument(why);
  return Solver(factors, rho, source, options, radiosity, progress).run();
}

}  // namespace truebox

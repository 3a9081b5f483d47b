// SPDX-License-Identifier: BSD-3-Clause
#include "transport/shared_directions.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "transport/interpolated_product.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr Index kFewestBands = 12;  // below, plain iterations read the matrix as seldom
// Shares of the residual that a band may keep: at which its steps end, and what the products of one
// step and of the check at the end may miss.
constexpr double kStop = 0.5, kStepMiss = 0.06, kCheckMiss = 0.2;
constexpr Index kChunk = 64;  // rows that are summed in one go, whatever the threads

// Of two, a NaN rather than a number.
double larger(double a, double b) { return a >= b ? a : b; }

class SharedDirections {
 public:
  explicit SharedDirections(SolveState& state)
      : s_(state), products_(s_.exchange), n_(s_.elements()), m_(s_.bands()) {}

  bool worthwhile() const {
    if (m_ < kFewestBands) return false;
    for (Index k = 0; k < m_; ++k)
      if (!(s_.contraction(k) < 1.0)) return false;  // no residual would do
    return true;
  }

  void run() {
    weigh();
    norm_ = s_.b.cwiseAbs().colwise().maxCoeff().transpose();
    step_ = Eigen::VectorXd::Ones(m_);
    for (check(); !open_.empty(); check()) {
      if (s_.diverged() || s_.out_of_iterations()) return;
      iterate();
    }
    if (!s_.diverged()) s_.summary.outcome = SolveOutcome::converged;
  }

 private:
  // D = A / rho of the symmetrised system, 0 of black elements, and rho / A.
  void weigh() {
    weight_.resize(n_, m_);
    reflect_.resize(n_, m_);
    for (Index i = 0; i < n_; ++i)
      for (Index k = 0; k < m_; ++k) {
        reflect_(i, k) = s_.rho(i, k) / s_.exchange.area_m2()[i];
        weight_(i, k) = s_.rho(i, k) > 0.0 ? 1.0 / reflect_(i, k) : 0.0;
      }
  }

  // The residual with which a band's bound is what was asked for.
  double goal(Index k) const {
    return s_.options.relative_bound * norm_[k] * (1.0 - s_.contraction(k));
  }

  BandMatrix product(const BandMatrix& x, const Eigen::VectorXd& allowed) {
    InterpolatedProduct found = products_(x, allowed);
    missed_ = std::move(found.missed);
    s_.summary.matrix_passes += static_cast<double>(found.products) / static_cast<double>(m_);
    most_products_ = std::max(most_products_, found.products);
    s_.summary.bands_reduced = static_cast<int>(m_ - most_products_);
    return std::move(found.product);
  }

  // Calls row(i, sums) for all rows; sums[0 .. parts - 1][band] are added up, or the largest taken
  // where `largest`, in an order that threads do not change.
  template <class Row>
  Eigen::MatrixXd over_rows(Index sums, Index largest, const Row& row) const {
    const Index chunks = (n_ + kChunk - 1) / kChunk, parts = sums + largest;
    std::vector<Eigen::MatrixXd> part(static_cast<std::size_t>(chunks));
    tbb::parallel_for(tbb::blocked_range<Index>(0, chunks, 1), [&](const auto& range) {
      for (Index chunk = range.begin(); chunk < range.end(); ++chunk) {
        Eigen::MatrixXd& mine = part[static_cast<std::size_t>(chunk)];
        mine.setZero(m_, parts);
        for (Index i = chunk * kChunk; i < std::min(n_, (chunk + 1) * kChunk); ++i)
          row(i, mine.data());
      }
    });
    Eigen::MatrixXd all = Eigen::MatrixXd::Zero(m_, parts);
    for (const Eigen::MatrixXd& mine : part) {
      all.leftCols(sums) += mine.leftCols(sums);
      all.rightCols(largest) = all.rightCols(largest).binaryExpr(mine.rightCols(largest), &larger);
    }
    return all;
  }

  // The true residual, from which bands that miss their bound start (again).
  void check() {
    Eigen::VectorXd allowed(m_);
    for (Index k = 0; k < m_; ++k) allowed[k] = goal(k) > 0.0 ? kCheckMiss * goal(k) : -1.0;
    s_.gathered = product(s_.b, allowed);
    r_.resize(n_, m_);
    const Eigen::MatrixXd all = over_rows(1, 2, [&](Index i, double* sums) {
      for (Index k = 0; k < m_; ++k) {
        const double b = s_.b(i, k);
        const double r = s_.source(i, k) + reflect_(i, k) * s_.gathered(i, k) - b;
        r_(i, k) = r;
        sums[k] += weight_(i, k) * r * r;
        sums[m_ + k] = larger(sums[m_ + k], std::abs(r));
        sums[2 * m_ + k] = larger(sums[2 * m_ + k], std::abs(b));
      }
    });
    rz_ = all.col(0);
    size_ = all.col(1);
    norm_ = all.col(2);
    // What the product missed is wrong in the residual, and in the irradiance.
    size_ += std::max(1.0, s_.exchange.row_sum_max()) * missed_;
    note();
    open_.clear();
    p_ = r_;
    for (Index k = 0; k < m_; ++k) {
      s_.summary.error_bound[k] = size_[k] / (1.0 - s_.contraction(k));
      if (size_[k] > goal(k))
        open_.push_back(k);
      else
        p_.col(k).setZero();
    }
  }

  void iterate() {
    while (!open_.empty() && !s_.diverged() && !s_.out_of_iterations()) {
      Eigen::VectorXd allowed = Eigen::VectorXd::Constant(m_, -1.0);
      for (Index k : open_) allowed[k] = kStepMiss * goal(k) / std::max(1.0, step_[k]);
      const BandMatrix gathered = product(p_, allowed);
      take_step(gathered);
      ++s_.summary.iterations;
      note();
      s_.tell();
    }
  }

  void take_step(const BandMatrix& gathered) {
    BandMatrix ap(n_, m_);
    const Eigen::VectorXd pap = over_rows(1, 0, [&](Index i, double* sums) {
      for (Index k = 0; k < m_; ++k) {
        ap(i, k) = p_(i, k) - reflect_(i, k) * gathered(i, k);
        sums[k] += weight_(i, k) * p_(i, k) * ap(i, k);
      }
    });
    Eigen::VectorXd alpha = Eigen::VectorXd::Zero(m_), beta = Eigen::VectorXd::Zero(m_);
    for (Index k : open_)
      if (pap[k] > 0.0) step_[k] = alpha[k] = rz_[k] / pap[k];
    const Eigen::MatrixXd all = over_rows(1, 2, [&](Index i, double* sums) {
      for (Index k = 0; k < m_; ++k) {
        const double b = s_.b(i, k) += alpha[k] * p_(i, k);
        const double r = r_(i, k) -= alpha[k] * ap(i, k);
        sums[k] += weight_(i, k) * r * r;
        sums[m_ + k] = larger(sums[m_ + k], std::abs(r));
        sums[2 * m_ + k] = larger(sums[2 * m_ + k], std::abs(b));
      }
    });
    norm_ = all.col(2);
    std::vector<Index> open;
    Eigen::VectorXd keep = Eigen::VectorXd::Zero(m_);
    for (Index k : open_) {
      size_[k] = all(k, 1);
      if (size_[k] <= kStop * goal(k)) continue;
      open.push_back(k);
      keep[k] = 1.0;
      if (rz_[k] > 0.0) beta[k] = all(k, 0) / rz_[k];
      rz_[k] = all(k, 0);
    }
    open_ = std::move(open);
    over_rows(0, 0, [&](Index i, double*) {
      for (Index k = 0; k < m_; ++k) p_(i, k) = keep[k] * r_(i, k) + beta[k] * p_(i, k);
    });
  }

  // For those who watch: the worst residual and bound.
  void note() {
    double worst = 0.0, worst_bound = 0.0;
    for (Index k = 0; k < m_; ++k) {
      if (size_[k] == 0.0 && norm_[k] == 0.0) continue;
      worst = larger(size_[k] / norm_[k], worst);
      worst_bound = larger(size_[k] / norm_[k] / (1.0 - s_.contraction(k)), worst_bound);
    }
    s_.summary.residual_history.push_back(worst);
    if (!std::isfinite(worst)) {
      s_.summary.outcome = SolveOutcome::diverged;
      s_.summary.error_bound.setConstant(std::numeric_limits<double>::infinity());
    }
    if (s_.progress() && worst_bound > 0.0)
      s_.progress()("radiosity", std::clamp(std::log(std::min(1.0, worst_bound)) /
                                                std::log(s_.options.relative_bound),
                                            0.0, 1.0));
  }

  SolveState& s_;
  InterpolatedProducts products_;
  Index n_, m_, most_products_ = 0;
  BandMatrix weight_, reflect_, r_, p_;
  std::vector<Index> open_;           // bands that need more steps
  Eigen::VectorXd norm_, size_, rz_;  // max |B|, max |r|, r . r of each band
  Eigen::VectorXd step_, missed_;     // the last step's length; what the last product missed
};

}  // namespace

bool solve_on_shared_directions(SolveState& state) {
  SharedDirections directions(state);
  if (!directions.worthwhile()) return false;
  directions.run();
  return true;
}

}  // namespace truebox

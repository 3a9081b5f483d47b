// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "transport/solve_state.h"

namespace truebox {
namespace {

using Eigen::Index;

// Southwell relaxation seen as light: the element with most unshot power sends it to all others.
// What was shot, B - U, has the residual U, so B has rho F U.
class Shooting {
 public:
  Shooting(SolveState& state, bool ambient) : s_(state), ambient_(ambient), unshot_(s_.b) {
    // Bands count by their share of their own light, or the brightest would choose for all.
    const Eigen::RowVectorXd emitted = s_.exchange.area_m2().transpose() * unshot_.cwiseAbs();
    weight_ = emitted.unaryExpr([](double power) { return power > 0.0 ? 1.0 / power : 0.0; });
    power_.resize(s_.elements());
    for (Index i = 0; i < power_.size(); ++i) power_[i] = power_of(i);
  }

  void run() {
    const Index n = s_.elements();
    const Index between_checks = std::max<Index>(1, n / 16);
    Eigen::VectorXd row(n);
    while (!s_.meets_bound(unshot_)) {
      if (s_.diverged()) return;
      if (s_.summary.matrix_passes >= s_.options.iteration_limit) break;
      for (Index shot = 0; shot < between_checks; ++shot) shoot(row);
    }
    show(s_.b);
    if (!s_.finish() && !s_.diverged()) s_.summary.outcome = SolveOutcome::iteration_limit;
  }

 private:
  double power_of(Index i) const {
    return s_.exchange.area_m2()[i] * weight_.dot(unshot_.row(i).cwiseAbs());
  }

  void shoot(Eigen::VectorXd& row) {
    Index i = 0;
    if (!(power_.maxCoeff(&i) > 0.0)) return;
    s_.exchange.row(i, row);
    const Eigen::RowVectorXd sent = unshot_.row(i);
    unshot_.row(i).setZero();
    for (Index j = 0; j < s_.elements(); ++j) {
      if (row[j] == 0.0) continue;
      const Eigen::RowVectorXd received =
          (row[j] / s_.exchange.area_m2()[j]) * s_.rho.row(j).cwiseProduct(sent);
      s_.b.row(j) += received;
      unshot_.row(j) += received;
      power_[j] = power_of(j);
    }
    power_[i] = power_of(i);
    ++s_.summary.iterations;
    s_.summary.matrix_passes += 1.0 / static_cast<double>(s_.elements());
    if (!s_.options.on_progress) return;
    shown_ = s_.b;
    show(shown_);
    s_.options.on_progress(s_.summary.matrix_passes, shown_);
  }

  // Adds the ambient term: the unshot light as if spread evenly and reflected for ever by the mean
  // reflectance. Source: Cohen, Chen, Wallace, Greenberg (1988), eq. 14 to 16.
  void show(BandMatrix& radiosity) const {
    if (!ambient_) return;
    const Eigen::VectorXd& area = s_.exchange.area_m2();
    const Eigen::RowVectorXd mean_rho = area.transpose() * s_.rho / area.sum();
    const Eigen::RowVectorXd mean_unshot = area.transpose() * unshot_ / area.sum();
    const Eigen::RowVectorXd ambient = mean_unshot.array() / (1.0 - mean_rho.array());
    radiosity += s_.rho * ambient.asDiagonal();
  }

  SolveState& s_;
  bool ambient_;
  BandMatrix unshot_, shown_;
  Eigen::RowVectorXd weight_;
  Eigen::VectorXd power_;
};

}  // namespace

void solve_southwell(SolveState& state, bool ambient) { Shooting(state, ambient).run(); }

}  // namespace truebox

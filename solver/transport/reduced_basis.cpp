// SPDX-License-Identifier: BSD-3-Clause
#include "transport/reduced_basis.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "transport/band_product.h"
#include "transport/band_systems.h"
#include "transport/reflectance_group.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr Index kFewestBands = 12;  // below, plain iterations read the matrix as seldom
// Parts of the worst residual, and of what is allowed, that no functions are made for: the next
// ones change what is that small anyway.
constexpr double kNext = 0.03, kEnd = 0.25;
constexpr int kMostIdleRounds = 3;  // without a tenth less: rounding is reached

class ReducedBasis {
 public:
  explicit ReducedBasis(SolveState& state)
      : s_(state), n_(s_.elements()), m_(s_.bands()), systems_(m_) {}

  bool worthwhile() {
    if (m_ < kFewestBands) return false;
    for (Index k = 0; k < m_; ++k)
      if (!(s_.contraction(k) < 1.0)) return false;  // no residual would do
    groups_ = reflectance_groups(s_.exchange.area_m2(), s_.rho, s_.source);
    return !groups_.empty();
  }

  // Factors of so many, in all bands, take no more memory than a matrix of the elements, where that
  // is a burden at all.
  Index most_functions() const {
    const auto as_large = static_cast<Index>(static_cast<double>(n_) / std::sqrt(m_));
    return std::min<Index>(n_, std::clamp<Index>(as_large, 384, 1024));
  }

  // False if other methods must go on from here.
  bool run() {
    double best = std::numeric_limits<double>::infinity();
    for (int idle = 0; idle < kMostIdleRounds; ++s_.summary.iterations) {
      const double worst = measure();
      if (s_.options.on_progress) put(), s_.tell();
      if (ended(worst)) return put(), true;
      idle = worst < 0.9 * best ? 0 : idle + 1;
      best = std::min(best, worst);
      if (!extend(worst)) break;
    }
    s_.summary.bands_reduced = 0;
    return put(), false;
  }

 private:
  bool ended(double worst) {
    if (s_.diverged()) return true;
    if (worst <= 1.0) s_.summary.outcome = SolveOutcome::converged;
    return worst <= 1.0 || s_.out_of_iterations();
  }

  // Galerkin's solution y of all bands. With sqrt(rho) on both sides of K a black band is no
  // special case.
  BandMatrix coefficients() const {
    if (systems_.size() == 0) return BandMatrix(0, m_);
    const BandMatrix f = sqrt_rho_.cwiseProduct(tall_product(exchange_, emitted_));
    return emitted_ + sqrt_rho_.cwiseProduct(systems_.solve(f));
  }

  // The worst residual, in units of what is allowed.
  double measure() {
    const BandMatrix y = coefficients();
    ReflectanceGroup::Sizes sizes{Eigen::VectorXd::Zero(m_), Eigen::VectorXd::Zero(m_)};
    for (ReflectanceGroup& group : groups_) sizes.include(group.measure(y));
    const auto& [size, norm] = sizes;
    allowed_.resize(m_);
    double worst = 0.0, relative = 0.0;
    for (Index k = 0; k < m_; ++k) {
      const double left = 1.0 - s_.contraction(k);
      allowed_[k] = s_.options.relative_bound * norm[k] * left;
      s_.summary.error_bound[k] = size[k] / left;
      if (size[k] == 0.0) continue;
      worst = std::max(worst, size[k] / allowed_[k]);
      relative = std::max(relative, size[k] / norm[k]);
    }
    s_.summary.residual_history.push_back(relative);
    if (!size.allFinite() || !norm.allFinite()) {
      s_.summary.outcome = SolveOutcome::diverged;
      s_.summary.error_bound.setConstant(std::numeric_limits<double>::infinity());
    } else if (s_.progress() && worst > 0.0) {
      const double asked = std::log(s_.options.relative_bound);
      s_.progress()("radiosity", std::clamp(1.0 + std::log(worst) / asked, 0.0, 1.0));
    }
    return worst;
  }

  void put() {
    s_.gathered.resize(n_, m_);
    tbb::parallel_for(std::size_t{0}, groups_.size(),
                      [&](std::size_t g) { groups_[g].put(s_.b, s_.gathered); });
  }

  // More functions; false if there are none, or too many.
  bool extend(double worst) {
    const Index old = systems_.size();
    Index size = old;
    std::vector<ElementBlock> blocks;
    double columns = 0.0;
    std::vector<BandMatrix> added(groups_.size());
    tbb::parallel_for(std::size_t{0}, groups_.size(), [&](std::size_t g) {
      added[g] = groups_[g].extend(allowed_, std::max(kEnd, kNext * worst));
    });
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      const Index more = added[g].cols();
      if (more == 0) continue;
      groups_[g].number(size, more);
      size += more;
      columns += static_cast<double>(more * groups_[g].size()) / static_cast<double>(n_);
      blocks.push_back({groups_[g].elements(), std::move(added[g])});
    }
    if (blocks.empty() || size > most_functions()) return false;
    s_.summary.matrix_passes += columns / static_cast<double>(m_);
    most_added_ = std::max(most_added_, size - old);
    s_.summary.bands_reduced = static_cast<int>(std::max<Index>(0, m_ - most_added_));
    BandMatrix gathered = s_.exchange.product_of_blocks(blocks);
    for (Index i = 0; i < n_; ++i) gathered.row(i) /= s_.exchange.area_m2()[i];
    return join(gathered, old, size);
  }

  // What is known of new functions: F w, K, sqrt(rho) and their share of M.
  bool join(const BandMatrix& gathered, Index old, Index size) {
    BandMatrix rows(size - old, size);
    emitted_.conservativeResize(size, m_);
    sqrt_rho_.conservativeResize(size, m_);
    tbb::parallel_for(std::size_t{0}, groups_.size(),
                      [&](std::size_t g) { groups_[g].take(gathered); });
    for (const ReflectanceGroup& group : groups_) {
      if (group.functions().empty()) continue;
      rows(Eigen::all, group.functions()) = group.project(group.rows_of(gathered)).transpose();
      const BandMatrix emitted = group.project_source(old);
      const auto known = static_cast<std::size_t>(group.functions().size()) -
                         static_cast<std::size_t>(emitted.rows());
      for (Index f = 0; f < emitted.rows(); ++f) {
        const Index j = group.functions()[known + static_cast<std::size_t>(f)];
        emitted_.row(j) = emitted.row(f);
        sqrt_rho_.row(j) = group.rho().cwiseSqrt();
      }
    }
    exchange_.conservativeResize(size, size);
    exchange_.bottomRows(size - old) = rows;
    exchange_.topRightCorner(old, size - old) = rows.leftCols(old).transpose();
    return systems_.append(rows, sqrt_rho_.bottomRows(size - old));
  }

  SolveState& s_;
  Index n_, m_, most_added_ = 0;
  std::vector<ReflectanceGroup> groups_;
  BandSystems systems_;
  BandMatrix exchange_;            // K_ij = w_i . A F w_j
  BandMatrix emitted_, sqrt_rho_;  // w_j . A M and sqrt(rho), functions x bands
  Eigen::VectorXd allowed_;        // of each band: what its residual may be
};

}  // namespace

bool solve_on_reduced_basis(SolveState& state) {
  ReducedBasis basis(state);
  return basis.worthwhile() && basis.run();
}

}  // namespace truebox

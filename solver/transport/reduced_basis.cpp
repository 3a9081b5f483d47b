// SPDX-License-Identifier: BSD-3-Clause
#include "transport/reduced_basis.h"

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <limits>
#include <map>
#include <vector>

namespace truebox {
namespace {

using Eigen::Index;

constexpr Index kPanel = 8;         // bands solved together: one panel of the matrix product
constexpr Index kFewestBands = 17;  // below, two panels do it without
constexpr int kMostMaterials = 16;
constexpr double kDependent = 1e-12;  // a direction this small beside its vector is rounding

class ReducedBasis {
 public:
  explicit ReducedBasis(SolveState& state) : s_(state) {}

  bool worthwhile() {
    if (s_.bands() < kFewestBands) return false;
    return find_materials() && factor_source();
  }

  void run() {
    std::vector<Index> open(static_cast<std::size_t>(s_.bands()));
    for (Index k = 0; k < s_.bands(); ++k) open[static_cast<std::size_t>(k)] = k;
    s_.gathered.setZero(s_.elements(), s_.bands());
    bound_ = Eigen::VectorXd::Constant(s_.bands(), std::numeric_limits<double>::infinity());
    std::vector<Index> chosen = spread_bands();
    while (!open.empty()) {
      if (!solve_exactly(chosen)) return;
      std::erase_if(open, [&](Index k) { return std::ranges::find(chosen, k) != chosen.end(); });
      if (open.empty()) break;
      extend_basis(chosen);
      chosen = project(open);
    }
    s_.summary.error_bound = bound_;
    s_.summary.outcome = SolveOutcome::converged;
  }

 private:
  // Elements whose rows of rho are equal in every band are one material here.
  bool find_materials() {
    std::map<std::vector<double>, int> known;
    material_.resize(static_cast<std::size_t>(s_.elements()));
    for (Index i = 0; i < s_.elements(); ++i) {
      const auto row = s_.rho.row(i);
      const auto [at, is_new] = known.try_emplace(std::vector<double>(row.begin(), row.end()),
                                                  static_cast<int>(known.size()));
      if (is_new) material_rho_.push_back(row);
      if (known.size() > kMostMaterials) return false;
      material_[static_cast<std::size_t>(i)] = at->second;
    }
    return true;
  }

  // M = X Y with few columns in X: one pass finds F M of every band.
  bool factor_source() {
    if (!s_.source.allFinite()) return false;
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(s_.source);
    const Eigen::MatrixXd& r = qr.matrixR();
    Index rank = 0;
    const Index largest = std::min(r.rows(), r.cols());
    while (rank < largest && std::abs(r(rank, rank)) > 1e-14 * std::abs(r(0, 0))) ++rank;
    if (2 * rank > s_.bands()) return false;
    const Eigen::MatrixXd q = qr.householderQ() * Eigen::MatrixXd::Identity(s_.elements(), rank);
    Eigen::MatrixXd y = r.topRows(rank).triangularView<Eigen::Upper>();
    y = y * qr.colsPermutation().inverse();
    source_exchange_ = s_.exchange.product(q);
    s_.summary.matrix_passes += share_of_a_pass(rank);
    source_y_ = y;
    const BandMatrix rest = s_.source - q * y;
    source_rest_ =
        rest.cwiseAbs().colwise().maxCoeff().transpose() * std::max(1.0, s_.exchange.row_sum_max());
    return true;
  }

  // In units of a pass that takes all bands.
  double share_of_a_pass(Index columns) const {
    return static_cast<double>(columns) / static_cast<double>(s_.bands());
  }

  // Farthest-point choice: bands whose reflectances are unlike.
  std::vector<Index> spread_bands() const {
    Eigen::MatrixXd at(static_cast<Index>(material_rho_.size()), s_.bands());
    for (std::size_t m = 0; m < material_rho_.size(); ++m)
      at.row(static_cast<Index>(m)) = material_rho_[m];
    std::vector<Index> chosen;
    Index next = 0;
    at.colwise().maxCoeff().maxCoeff(&next);  // the most reflecting band is the hardest
    Eigen::VectorXd distance =
        Eigen::VectorXd::Constant(s_.bands(), std::numeric_limits<double>::infinity());
    while (static_cast<Index>(chosen.size()) < kPanel) {
      chosen.push_back(next);
      distance = distance.cwiseMin((at.colwise() - at.col(next)).colwise().norm().transpose());
      if (!(distance.maxCoeff(&next) > 0.0)) break;
    }
    return chosen;
  }

  bool solve_exactly(const std::vector<Index>& chosen) {
    const BandMatrix rho = s_.rho(Eigen::all, chosen), source = s_.source(Eigen::all, chosen);
    BandMatrix b = s_.b(Eigen::all, chosen);
    SolveOptions options = s_.options;
    if (options.on_progress)
      options.on_progress = [&](double passes, const BandMatrix& part) {
        s_.b(Eigen::all, chosen) = part;
        s_.options.on_progress(s_.summary.matrix_passes + share_of_a_pass(kPanel) * passes, s_.b);
      };
    SolveState part(s_.exchange, rho, source, options, b, s_.progress());
    solve_conjugate_gradient(part);
    s_.b(Eigen::all, chosen) = b;
    s_.gathered(Eigen::all, chosen) = part.gathered;
    s_.summary.iterations += part.summary.iterations;
    s_.summary.matrix_passes +=
        part.summary.matrix_passes * share_of_a_pass(static_cast<Index>(chosen.size()));
    s_.summary.residual_history.insert(s_.summary.residual_history.end(),
                                       part.summary.residual_history.begin(),
                                       part.summary.residual_history.end());
    bound_(chosen) = part.summary.error_bound;
    s_.summary.outcome = part.summary.outcome;
    if (part.summary.outcome == SolveOutcome::converged) return true;
    s_.summary.error_bound = bound_;
    return false;
  }

  // Adds the irradiance of solved bands, one vector a material, orthonormal in the area's measure.
  void extend_basis(const std::vector<Index>& chosen) {
    const BandMatrix irradiance = irradiance_of(chosen);
    const Eigen::VectorXd& area = s_.exchange.area_m2();
    std::vector<Eigen::VectorXd> added;
    std::vector<int> added_material;
    for (int m = 0; m < static_cast<int>(material_rho_.size()); ++m)
      for (Index k = 0; k < irradiance.cols(); ++k) {
        Eigen::VectorXd v = irradiance.col(k);
        for (Index i = 0; i < v.size(); ++i)
          if (material_[static_cast<std::size_t>(i)] != m) v[i] = 0.0;
        const double before = std::sqrt(v.cwiseAbs2().dot(area));
        for (int twice = 0; twice < 2; ++twice) {  // Gram-Schmidt loses digits the first time
          for (Index j = 0; j < basis_.cols(); ++j)
            if (basis_material_[static_cast<std::size_t>(j)] == m)
              v -= basis_.col(j).cwiseProduct(area).dot(v) * basis_.col(j);
          for (std::size_t j = 0; j < added.size(); ++j)
            if (added_material[j] == m) v -= added[j].cwiseProduct(area).dot(v) * added[j];
        }
        const double after = std::sqrt(v.cwiseAbs2().dot(area));
        if (!(after > kDependent * before)) continue;
        added.push_back(v / after);
        added_material.push_back(m);
      }
    const Index old = basis_.cols(), count = static_cast<Index>(added.size());
    basis_.conservativeResize(s_.elements(), old + count);
    for (Index j = 0; j < count; ++j) basis_.col(old + j) = added[static_cast<std::size_t>(j)];
    basis_material_.insert(basis_material_.end(), added_material.begin(), added_material.end());
    basis_exchange_.conservativeResize(s_.elements(), old + count);
    if (count > 0) basis_exchange_.rightCols(count) = s_.exchange.product(basis_.rightCols(count));
    s_.summary.matrix_passes += share_of_a_pass(count);
    projected_ = basis_.transpose() * basis_exchange_;
  }

  // F B of solved bands: (B - M) / rho where the element reflects; elsewhere it is not needed.
  BandMatrix irradiance_of(const std::vector<Index>& chosen) const {
    BandMatrix h(s_.elements(), static_cast<Index>(chosen.size()));
    for (std::size_t c = 0; c < chosen.size(); ++c)
      for (Index i = 0; i < h.rows(); ++i) {
        const double rho = s_.rho(i, chosen[c]);
        h(i, static_cast<Index>(c)) =
            rho > 0.0 ? (s_.b(i, chosen[c]) - s_.source(i, chosen[c])) / rho : 0.0;
      }
    return h;
  }

  // Galerkin in each open band: (I - T diag(rho)) c = W^T S M, T = W^T S W; then one bounce more,
  // B = M + rho F B~, whose residual is known. Takes the bands that meet the request out of `open`
  // and returns those to be solved next, worst first.
  std::vector<Index> project(std::vector<Index>& open) {
    const Index r = basis_.cols();
    const auto count = static_cast<Index>(open.size());
    const Eigen::MatrixXd source_y = source_y_(Eigen::all, open);
    const Eigen::MatrixXd right = (basis_.transpose() * source_exchange_) * source_y;
    Eigen::MatrixXd scaled(r, count), coefficients(r, count);
    for (Index c = 0; c < count; ++c) {
      Eigen::VectorXd rho(r);
      for (Index j = 0; j < r; ++j)
        rho[j] =
            material_rho_[static_cast<std::size_t>(basis_material_[static_cast<std::size_t>(j)])]
                         [open[static_cast<std::size_t>(c)]];
      Eigen::MatrixXd system = -projected_ * rho.asDiagonal();
      system.diagonal().array() += 1.0;
      coefficients.col(c) = system.partialPivLu().solve(right.col(c));
      scaled.col(c) = rho.cwiseProduct(coefficients.col(c));
    }
    const BandMatrix guess = basis_ * coefficients;  // H~ = F B~, elements x open bands
    BandMatrix bounced = source_exchange_ * source_y;
    bounced.noalias() += basis_exchange_ * scaled;
    std::vector<std::pair<double, Index>> missed;
    for (Index c = 0; c < count; ++c) {
      const Index band = open[static_cast<std::size_t>(c)];
      const Eigen::VectorXd h = bounced.col(c).cwiseQuotient(s_.exchange.area_m2());
      const Eigen::VectorXd residual = s_.rho.col(band).cwiseProduct(h - guess.col(c));
      s_.gathered.col(band) = bounced.col(c);
      s_.b.col(band) = s_.source.col(band) + s_.rho.col(band).cwiseProduct(h);
      const double q = s_.contraction(band);
      bound_[band] = q < 1.0 ? (residual.cwiseAbs().maxCoeff() + source_rest_[band]) / (1.0 - q)
                             : std::numeric_limits<double>::infinity();
      const double norm = s_.b.col(band).cwiseAbs().maxCoeff();
      if (bound_[band] <= s_.options.relative_bound * norm)
        ++s_.summary.bands_reduced;
      else
        missed.push_back({-bound_[band] / norm, band});
    }
    std::sort(missed.begin(), missed.end());
    open.clear();
    for (const auto& [bound, band] : missed) open.push_back(band);
    return {open.begin(), open.begin() + std::min<std::ptrdiff_t>(
                                             kPanel, static_cast<std::ptrdiff_t>(open.size()))};
  }

  SolveState& s_;
  std::vector<int> material_;                     // of each element
  std::vector<Eigen::RowVectorXd> material_rho_;  // of each material, one value a band
  BandMatrix source_exchange_;                    // S X, where M = X Y
  Eigen::MatrixXd source_y_;
  Eigen::VectorXd source_rest_;  // ||F (M - X Y)||_inf at most
  Eigen::MatrixXd basis_;        // W: irradiance restricted to one material
  std::vector<int> basis_material_;
  BandMatrix basis_exchange_;  // S W
  Eigen::MatrixXd projected_;  // W^T S W
  Eigen::VectorXd bound_;
};

}  // namespace

bool solve_on_reduced_basis(SolveState& state) {
  ReducedBasis basis(state);
  if (!basis.worthwhile()) return false;
  basis.run();
  return true;
}

}  // namespace truebox

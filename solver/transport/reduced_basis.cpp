// SPDX-License-Identifier: BSD-3-Clause
#include "transport/reduced_basis.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <vector>

#include "transport/band_product.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr Index kPanel = 8;         // vectors added at once: one panel of the matrix product
constexpr Index kFewestBands = 12;  // below, two panels do it without
constexpr int kMostMaterials = 16;
constexpr Index kMostVectors = 240;   // dense systems of that size cost what they save
constexpr std::size_t kLeaders = 16;  // bands whose residuals the space grows by at a time
constexpr std::size_t kPatience = 6;  // rounds that may pass before the worst bound has halved
constexpr double kDependent = 1e-10;  // a direction this small beside its vector is rounding
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Elements whose reflectances are equal in every band.
struct Material {
  std::vector<Index> elements;
  Eigen::RowVectorXd rho;   // of each band
  Eigen::MatrixXd vectors;  // of the space, on these elements, times sqrt(area): orthonormal
};

struct BasisVector {
  std::size_t material;
  Index column;
};

// One space for all bands, W: irradiances restricted to one material each, orthonormal in the
// area's measure. In every band H~ = W c stands for F B; Galerkin's condition
//   c = W^T S M + T diag(rho) c,   T = W^T S W,
// is solved in its symmetric form. B~ = M + rho H~ is then sent round once more, B = M + rho F B~,
// which S W gives without a pass, and so does its residual. W grows by the residuals of a few
// bands, the leaders; the others are looked at when those are done.
class SharedSpace {
 public:
  explicit SharedSpace(SolveState& state) : s_(state) {}

  bool worthwhile() {
    if (s_.bands() < kFewestBands) return false;
    return find_materials() && factor_source();
  }

  void run() {
    std::vector<Index> open(static_cast<std::size_t>(s_.bands()));
    std::iota(open.begin(), open.end(), 0);
    s_.gathered.setZero(s_.elements(), s_.bands());
    bound_ = norm_ = Eigen::VectorXd::Constant(s_.bands(), kInfinity);
    reserve(0);
    project(open);
    std::vector<Index> leaders = unlike_bands(still_open(open));
    while (!leaders.empty()) {
      if (is_stuck(leaders) || !grow(leaders)) {
        project(open);
        return iterate(still_open(open));
      }
      project(leaders);
      leaders = still_open(leaders);
      s_.tell();
      if (!leaders.empty()) continue;
      project(open);
      open = leaders = still_open(open);
      leaders.resize(std::min<std::size_t>(leaders.size(), kLeaders));
    }
    s_.summary.error_bound = bound_;
    s_.summary.bands_reduced = static_cast<int>(s_.bands());
    s_.summary.outcome = SolveOutcome::converged;
  }

 private:
  bool find_materials() {
    std::map<std::vector<double>, std::size_t> known;
    for (Index i = 0; i < s_.elements(); ++i) {
      const auto row = s_.rho.row(i);
      const auto [at, is_new] =
          known.try_emplace(std::vector<double>(row.begin(), row.end()), known.size());
      if (known.size() > kMostMaterials) return false;
      if (is_new) materials_.push_back({{}, row, {}});
      materials_[at->second].elements.push_back(i);
    }
    for (Material& material : materials_)
      material.vectors.resize(static_cast<Index>(material.elements.size()), 0);
    return true;
  }

  // M = X Y with few columns in X: one pass finds F M of every band.
  bool factor_source() {
    if (!s_.source.allFinite()) return false;
    BandMatrix rest = s_.source;
    const double negligible = 1e-14 * rest.cwiseAbs().maxCoeff();
    std::vector<Eigen::VectorXd> x;
    std::vector<Eigen::RowVectorXd> y;
    while (rest.cwiseAbs().maxCoeff() > negligible) {
      if (2 * static_cast<Index>(x.size()) >= s_.bands()) return false;
      Index column = 0;
      rest.colwise().squaredNorm().maxCoeff(&column);
      x.push_back(rest.col(column).normalized());
      y.push_back(x.back().transpose() * rest);
      rest.noalias() -= x.back() * y.back();
    }
    const auto rank = static_cast<Index>(x.size());
    BandMatrix factor(s_.elements(), rank);
    source_y_.resize(rank, s_.bands());
    for (Index c = 0; c < rank; ++c) {
      factor.col(c) = x[static_cast<std::size_t>(c)];
      source_y_.row(c) = y[static_cast<std::size_t>(c)];
    }
    source_exchange_ = s_.exchange.product(factor);
    count_columns(rank);
    source_rest_ =
        rest.cwiseAbs().colwise().maxCoeff().transpose() * std::max(1.0, s_.exchange.row_sum_max());
    return true;
  }

  // In units of a pass that takes all bands.
  void count_columns(Index columns) {
    s_.summary.matrix_passes += static_cast<double>(columns) / static_cast<double>(s_.bands());
  }

  // Of the material that each vector of the basis lives on.
  Eigen::VectorXd reflectance_on_basis(Index band) const {
    Eigen::VectorXd rho(vectors());
    for (Index j = 0; j < rho.size(); ++j)
      rho[j] = materials_[vectors_[static_cast<std::size_t>(j)].material].rho[band];
    return rho;
  }

  // (I - sqrt(rho) T sqrt(rho)) d = sqrt(rho) W^T S M is positive definite; rho c = sqrt(rho) d.
  // Columns of `coefficients` (c) and `reflected` (rho c) belong to `bands`.
  void solve_projected(const std::vector<Index>& bands, const Eigen::MatrixXd& right,
                       BandMatrix& coefficients, BandMatrix& reflected) const {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, bands.size(), 4), [&](const auto& range) {
      Eigen::MatrixXd system;
      for (std::size_t at = range.begin(); at < range.end(); ++at) {
        const auto column = static_cast<Index>(at);
        const Eigen::VectorXd root = reflectance_on_basis(bands[at]).cwiseSqrt();
        system = -(root.asDiagonal() * projected_ * root.asDiagonal());
        system.diagonal().array() += 1.0;
        const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(system);
        const Eigen::VectorXd d = factor.solve(root.cwiseProduct(right.col(column)));
        const Eigen::VectorXd rho_c = root.cwiseProduct(d);
        reflected.col(column) = rho_c;
        coefficients.col(column) = right.col(column) + projected_ * rho_c;
      }
    });
  }

  // Finds radiosity, irradiance and bound of these bands, and the residuals that the space leaves.
  void project(const std::vector<Index>& bands) {
    const auto count = static_cast<Index>(bands.size());
    const Eigen::MatrixXd source_y = source_y_(Eigen::all, bands);
    BandMatrix coefficients(vectors(), count), reflected(vectors(), count);
    solve_projected(bands, (basis_.leftCols(vectors()).transpose() * source_exchange_) * source_y,
                    coefficients, reflected);
    const BandMatrix guess = tall_product(basis_, coefficients);
    BandMatrix bounced = tall_product(source_exchange_, source_y);
    bounced += tall_product(basis_exchange_, reflected);
    residual_.resize(s_.elements(), s_.bands());
    Eigen::ArrayXd size = Eigen::ArrayXd::Zero(count), norm = size;
    for (Index i = 0; i < s_.elements(); ++i)
      for (Index c = 0; c < count; ++c) {
        const Index band = bands[static_cast<std::size_t>(c)];
        const double h = bounced(i, c) / s_.exchange.area_m2()[i], rho = s_.rho(i, band);
        s_.gathered(i, band) = bounced(i, c);
        s_.b(i, band) = s_.source(i, band) + rho * h;
        residual_(i, band) = rho * (h - guess(i, c));
        size[c] = larger(size[c], std::abs(residual_(i, band)));
        norm[c] = larger(norm[c], std::abs(s_.b(i, band)));
      }
    for (Index c = 0; c < count; ++c) {
      const Index band = bands[static_cast<std::size_t>(c)];
      const double q = s_.contraction(band);
      norm_[band] = norm[c];
      bound_[band] = q < 1.0 ? (size[c] + source_rest_[band]) / (1.0 - q) : kInfinity;
    }
    note(bands);
  }

  // Of two, a NaN rather than a number.
  static double larger(double a, double b) { return a >= b ? a : b; }

  double relative_bound(Index band) const {
    return norm_[band] > 0.0 || bound_[band] > 0.0 ? bound_[band] / norm_[band] : 0.0;
  }

  // Those that do not meet the request, worst first.
  std::vector<Index> still_open(std::vector<Index> bands) const {
    std::erase_if(bands, [&](Index k) { return relative_bound(k) <= s_.options.relative_bound; });
    std::sort(bands.begin(), bands.end(),
              [&](Index a, Index b) { return relative_bound(a) > relative_bound(b); });
    return bands;
  }

  // For those who watch: the worst residual and bound of these bands.
  void note(const std::vector<Index>& bands) {
    double worst = 0.0, worst_residual = 0.0;
    for (Index k : bands) {
      worst = std::max(worst, relative_bound(k));
      worst_residual = std::max(worst_residual, relative_bound(k) * (1.0 - s_.contraction(k)));
    }
    s_.summary.residual_history.push_back(worst_residual);
    if (s_.progress() && worst > 0.0)
      s_.progress()("radiosity",
                    std::clamp(std::log(std::min(1.0, worst)) / std::log(s_.options.relative_bound),
                               0.0, 1.0));
  }

  // Farthest-point choice of those whose reflectances are unlike, the worst first.
  std::vector<Index> unlike_bands(const std::vector<Index>& open) const {
    const auto materials = static_cast<Index>(materials_.size());
    Eigen::MatrixXd at(materials, static_cast<Index>(open.size()));
    for (Index m = 0; m < materials; ++m)
      at.row(m) = materials_[static_cast<std::size_t>(m)].rho(open);
    std::vector<Index> chosen;
    Eigen::VectorXd distance = Eigen::VectorXd::Constant(at.cols(), kInfinity);
    for (Index next = 0; chosen.size() < std::min(kLeaders, open.size());) {
      chosen.push_back(open[static_cast<std::size_t>(next)]);
      distance = distance.cwiseMin((at.colwise() - at.col(next)).colwise().norm().transpose());
      if (!(distance.maxCoeff(&next) > 0.0)) break;
    }
    return chosen;
  }

  // Whether the last rounds have not even halved the leaders' worst bound.
  bool is_stuck(const std::vector<Index>& leaders) {
    worst_.push_back(0.0);
    for (Index k : leaders) worst_.back() = std::max(worst_.back(), relative_bound(k));
    const std::size_t rounds = worst_.size();
    return !std::isfinite(worst_.back()) || vectors() >= kMostVectors ||
           (rounds > kPatience && worst_.back() > 0.5 * worst_[rounds - 1 - kPatience]);
  }

  // Residuals on one material, times sqrt(area), in parts of their band's relative bound.
  Eigen::MatrixXd residual_on(const Material& material, const std::vector<Index>& bands) const {
    Eigen::MatrixXd part(static_cast<Index>(material.elements.size()),
                         static_cast<Index>(bands.size()));
    for (Index c = 0; c < part.cols(); ++c) {
      const Index band = bands[static_cast<std::size_t>(c)];
      const double weight = 1.0 / (norm_[band] * (1.0 - s_.contraction(band)));
      for (Index i = 0; i < part.rows(); ++i) {
        const Index element = material.elements[static_cast<std::size_t>(i)];
        part(i, c) = weight * std::sqrt(s_.exchange.area_m2()[element]) * residual_(element, band);
      }
    }
    return part;
  }

  // Takes up to a panel of directions out of the leaders' residuals, the largest first:
  // Gram-Schmidt with pivoting over bands and materials. False if there is none.
  bool grow(const std::vector<Index>& leaders) {
    std::vector<Eigen::MatrixXd> parts;
    Eigen::MatrixXd size2(static_cast<Index>(materials_.size()),
                          static_cast<Index>(leaders.size()));
    for (std::size_t m = 0; m < materials_.size(); ++m) {
      parts.push_back(residual_on(materials_[m], leaders));
      size2.row(static_cast<Index>(m)) = parts[m].colwise().squaredNorm();
    }
    const std::size_t old = vectors_.size();
    const double negligible = kDependent * kDependent * size2.maxCoeff();
    while (vectors_.size() < old + kPanel) {
      Index m = 0, k = 0;
      if (!(size2.maxCoeff(&m, &k) > negligible)) break;
      const auto material = static_cast<std::size_t>(m);
      if (append(material, parts[material].col(k)))
        size2.row(m) -=
            (materials_[material].vectors.rightCols(1).transpose() * parts[material]).cwiseAbs2();
      size2(m, k) = 0.0;
    }
    if (vectors_.size() == old) return false;
    extend_products(static_cast<Index>(old));
    ++s_.summary.iterations;
    return true;
  }

  // Makes v orthonormal to the vectors of its material; false if it depends on them.
  bool append(std::size_t index, Eigen::VectorXd v) {
    Material& material = materials_[index];
    const double before = v.norm();
    for (int twice = 0; twice < 2; ++twice)  // Gram-Schmidt loses digits the first time
      v -= material.vectors * (material.vectors.transpose() * v);
    const double after = v.norm();
    if (!(after > kDependent * before)) return false;
    v /= after;
    material.vectors.conservativeResize(v.size(), material.vectors.cols() + 1);
    material.vectors.rightCols(1) = v;
    vectors_.push_back({index, material.vectors.cols() - 1});
    return true;
  }

  // W, S W and W^T S W of the vectors from `old` on.
  void extend_products(Index old) {
    const Index all = vectors(), count = all - old;
    BandMatrix fresh = BandMatrix::Zero(s_.elements(), count);
    for (Index c = 0; c < count; ++c) {
      const BasisVector& vector = vectors_[static_cast<std::size_t>(old + c)];
      const Material& material = materials_[vector.material];
      for (std::size_t i = 0; i < material.elements.size(); ++i)
        fresh(material.elements[i], c) = material.vectors(static_cast<Index>(i), vector.column) /
                                         std::sqrt(s_.exchange.area_m2()[material.elements[i]]);
    }
    const BandMatrix product = s_.exchange.product(fresh);
    count_columns(count);
    if (all > basis_.cols()) reserve(all);
    basis_.middleCols(old, count) = fresh;
    basis_exchange_.middleCols(old, count) = product;
    projected_.conservativeResize(all, all);
    projected_.rightCols(count) = basis_.leftCols(all).transpose() * product;
    projected_.bottomRows(count) = projected_.rightCols(count).transpose();
  }

  // Room for more vectors, in few steps: rows are stored one after the other.
  void reserve(Index vectors) {
    const Index room = std::max<Index>(2 * vectors, 32);
    basis_.conservativeResize(s_.elements(), room);
    basis_exchange_.conservativeResize(s_.elements(), room);
  }

  Index vectors() const { return static_cast<Index>(vectors_.size()); }

  // Conjugate gradients in these bands, from where the space has brought them.
  void iterate(const std::vector<Index>& bands) {
    const BandMatrix rho = s_.rho(Eigen::all, bands), source = s_.source(Eigen::all, bands);
    BandMatrix b = s_.b(Eigen::all, bands);
    const double share = static_cast<double>(bands.size()) / static_cast<double>(s_.bands());
    SolveOptions options = s_.options;
    if (options.on_progress)
      options.on_progress = [&](double passes, const BandMatrix& part) {
        s_.b(Eigen::all, bands) = part;
        s_.options.on_progress(s_.summary.matrix_passes + share * passes, s_.b);
      };
    SolveState part(s_.exchange, rho, source, options, b, s_.progress());
    solve_conjugate_gradient(part);
    s_.b(Eigen::all, bands) = b;
    s_.gathered(Eigen::all, bands) = part.gathered;
    bound_(bands) = part.summary.error_bound;
    s_.summary.error_bound = bound_;
    s_.summary.bands_reduced = static_cast<int>(s_.bands() - rho.cols());
    s_.summary.iterations += part.summary.iterations;
    s_.summary.matrix_passes += share * part.summary.matrix_passes;
    s_.summary.residual_history.insert(s_.summary.residual_history.end(),
                                       part.summary.residual_history.begin(),
                                       part.summary.residual_history.end());
    s_.summary.outcome = part.summary.outcome;
  }

  SolveState& s_;
  std::vector<Material> materials_;
  BandMatrix source_exchange_;  // S X, where M = X Y
  Eigen::MatrixXd source_y_;
  Eigen::VectorXd source_rest_;       // ||F (M - X Y)||_inf at most
  BandMatrix basis_;                  // W, elements x vectors, with room for more
  std::vector<BasisVector> vectors_;  // the columns of W
  BandMatrix basis_exchange_;         // S W
  Eigen::MatrixXd projected_;         // W^T S W
  BandMatrix residual_;               // of B~, elements x bands
  Eigen::VectorXd bound_, norm_;      // max |B| of each band
  std::vector<double> worst_;         // the leaders' relative bound, round by round
};

}  // namespace

bool solve_on_reduced_basis(SolveState& state) {
  SharedSpace space(state);
  if (!space.worthwhile()) return false;
  space.run();
  return true;
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "transport/reflectance_group.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "transport/band_product.h"
#include "transport/many_targets.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr Index kSample = 96;  // elements that bands are chosen by, at first
constexpr Index kChunk = 64;   // rows that are measured in one go, whatever the threads
constexpr std::size_t kMostGroups = 64;
constexpr Index kRoom = 64;          // functions, at first
constexpr double kDependent = 1e-8;  // of a column: what rounding leaves of one of the others

// Of two, a NaN rather than a number.
double larger(double a, double b) { return a >= b || a != a ? a : b; }

// Of one row: B - values becomes the residual M + rho H - values, its size and B's are included.
TRUEBOX_MANY_TARGETS
void measure_row(Index bands, const double* source, const double* rho, const double* irradiance,
                 double* __restrict values, double* __restrict residual,
                 double* __restrict radiosity) {
  for (Index k = 0; k < bands; ++k) {
    const double b = source[k] + rho[k] * irradiance[k];
    const double r = b - values[k];
    values[k] = r;
    const double r_size = std::abs(r), b_size = std::abs(b);
    residual[k] = residual[k] >= r_size || residual[k] != residual[k] ? residual[k] : r_size;
    radiosity[k] = radiosity[k] >= b_size || radiosity[k] != radiosity[k] ? radiosity[k] : b_size;
  }
}

// Room for `columns`, the first `used` kept.
void make_room(BandMatrix& matrix, Index used, Index columns) {
  if (columns <= matrix.cols()) return;
  BandMatrix wider(matrix.rows(), std::max({2 * matrix.cols(), columns, kRoom}));
  wider.leftCols(used) = matrix.leftCols(used);
  matrix.swap(wider);
}

}  // namespace

ReflectanceGroup::ReflectanceGroup(std::vector<Index> elements, const Eigen::VectorXd& area_m2,
                                   const BandMatrix& rho, const BandMatrix& source)
    : elements_(std::move(elements)),
      area_m2_(area_m2(elements_)),
      rho_(rho.row(elements_.front())),
      source_(rows_of(source)),
      residual_(size(), rho.cols()),
      irradiance_(size(), rho.cols()),
      values_(size(), 0),
      gathered_(size(), 0),
      is_source_(!source_.isZero(0.0)) {
  vectors_.resize(0, size());
  const Index count = std::min(size(), kSample);
  for (Index r = 0; r < count; ++r) sample_.push_back(r * size() / count);
}

BandMatrix ReflectanceGroup::rows_of(const BandMatrix& all) const {
  BandMatrix rows(size(), all.cols());
  for (Index i = 0; i < size(); ++i) rows.row(i) = all.row(elements_[static_cast<std::size_t>(i)]);
  return rows;
}

void ReflectanceGroup::Sizes::include(const Sizes& other) {
  residual = residual.binaryExpr(other.residual, &larger).eval();
  radiosity = radiosity.binaryExpr(other.radiosity, &larger).eval();
}

ReflectanceGroup::Sizes ReflectanceGroup::measure(const BandMatrix& coefficients) {
  const Index bands = rho_.size(), chunks = (size() + kChunk - 1) / kChunk;
  tall_product(gathered_, coefficients, irradiance_);
  tall_product(values_, coefficients(functions_, Eigen::all), residual_);
  std::vector<Sizes> part(static_cast<std::size_t>(chunks));
  tbb::parallel_for(Index{0}, chunks, [&](Index chunk) {
    Sizes& sizes = part[static_cast<std::size_t>(chunk)];
    sizes = {Eigen::VectorXd::Zero(bands), Eigen::VectorXd::Zero(bands)};
    for (Index i = chunk * kChunk; i < std::min(size(), (chunk + 1) * kChunk); ++i)
      measure_row(bands, source_.data() + i * bands, rho_.data(), irradiance_.data() + i * bands,
                  residual_.data() + i * bands, sizes.residual.data(), sizes.radiosity.data());
  });
  for (std::size_t c = 1; c < part.size(); ++c) part[0].include(part[c]);
  return part[0];
}

void ReflectanceGroup::put(BandMatrix& radiosity, BandMatrix& power) const {
  for (Index i = 0; i < size(); ++i) {
    const Index element = elements_[static_cast<std::size_t>(i)];
    power.row(element) = area_m2_[i] * irradiance_.row(i);
    radiosity.row(element) = source_.row(i) + rho_.cwiseProduct(irradiance_.row(i));
  }
}

// Gram-Schmidt with pivots on a sample of elements, in units of what is allowed: the worst band
// next.
std::vector<Index> ReflectanceGroup::chosen_on_sample(const Eigen::VectorXd& allowed,
                                                      double leave) const {
  Eigen::MatrixXd rest(static_cast<Index>(sample_.size()), allowed.size());
  for (Index k = 0; k < rest.cols(); ++k)
    for (Index r = 0; r < rest.rows(); ++r)
      rest(r, k) =
          allowed[k] > 0.0 ? residual_(sample_[static_cast<std::size_t>(r)], k) / allowed[k] : 0.0;
  std::vector<Index> bands;
  while (static_cast<Index>(bands.size()) < std::min(rest.rows(), rest.cols())) {
    Index worst = 0;
    if (!(rest.cwiseAbs().colwise().maxCoeff().maxCoeff(&worst) > leave)) break;
    const Eigen::VectorXd direction = rest.col(worst).normalized();
    rest.noalias() -= direction * (direction.transpose() * rest).eval();
    rest.col(worst).setZero();
    bands.push_back(worst);
  }
  return bands;
}

// If only elements outside the sample are worse than that, the worst of them joins it.
std::vector<Index> ReflectanceGroup::bands_to_follow(const Eigen::VectorXd& allowed, double leave) {
  std::vector<Index> bands = chosen_on_sample(allowed, leave);
  if (!bands.empty()) return bands;
  double most = leave;
  Index element = -1;
  for (Index i = 0; i < size(); ++i)
    for (Index k = 0; k < allowed.size(); ++k)
      if (allowed[k] > 0.0 && std::abs(residual_(i, k)) > most * allowed[k]) {
        most = std::abs(residual_(i, k)) / allowed[k];
        element = i;
      }
  if (element < 0) return {};
  sample_.push_back(element);
  return chosen_on_sample(allowed, leave);
}

// Residuals of some bands less what they have of the functions and of each other: little of the
// former by Galerkin's condition, so that once is enough; twice among themselves.
Eigen::MatrixXd ReflectanceGroup::orthonormal_part(const std::vector<Index>& bands,
                                                   const Eigen::VectorXd& allowed) const {
  BandMatrix x(size(), static_cast<Index>(bands.size()));
  for (Index i = 0; i < size(); ++i)
    for (Index c = 0; c < x.cols(); ++c) {
      const Index k = bands[static_cast<std::size_t>(c)];
      x(i, c) = residual_(i, k) / allowed[k];
    }
  if (!functions_.empty()) x -= tall_product(values_, project(x));
  Eigen::MatrixXd found(size(), x.cols());
  Index count = 0;
  for (Index c = 0; c < x.cols(); ++c) {
    Eigen::VectorXd w = x.col(c);
    const double before = std::sqrt(area_m2_.dot(w.cwiseAbs2()));
    for (int pass = 0; pass < 2; ++pass) {
      const Eigen::VectorXd weighted = area_m2_.cwiseProduct(w);
      w -= found.leftCols(count) * (found.leftCols(count).transpose() * weighted).eval();
    }
    const double norm = std::sqrt(area_m2_.dot(w.cwiseAbs2()));
    if (norm > kDependent * before) found.col(count++) = w / norm;
  }
  return found.leftCols(count);
}

void ReflectanceGroup::number(Index first, Index count) {
  for (Index f = 0; f < count; ++f) functions_.push_back(first + f);
}

BandMatrix ReflectanceGroup::extend(const Eigen::VectorXd& allowed, double leave) {
  const std::vector<Index> bands = bands_to_follow(allowed, leave);
  if (bands.empty()) return BandMatrix(size(), 0);
  const Eigen::MatrixXd added = orthonormal_part(bands, allowed);
  const auto old = static_cast<Index>(functions_.size()), more = added.cols();
  vectors_.conservativeResize(old + more, size());
  vectors_.bottomRows(more) = added.transpose();
  make_room(values_, old, old + more);
  values_.middleCols(old, more) = added;
  return added;
}

void ReflectanceGroup::take(const BandMatrix& gathered) {
  make_room(gathered_, gathered_count_, gathered_count_ + gathered.cols());
  gathered_.middleCols(gathered_count_, gathered.cols()) = rows_of(gathered);
  gathered_count_ += gathered.cols();
}

BandMatrix ReflectanceGroup::project(const BandMatrix& x) const {
  return tall_product(vectors_, area_m2_.asDiagonal() * x);
}

BandMatrix ReflectanceGroup::project_source(Index first) const {
  const auto begin = std::lower_bound(functions_.begin(), functions_.end(), first);
  const auto more = static_cast<Index>(functions_.end() - begin);
  if (!is_source_) return BandMatrix::Zero(more, source_.cols());
  return tall_product(vectors_.bottomRows(more), area_m2_.asDiagonal() * source_);
}

std::vector<ReflectanceGroup> reflectance_groups(const Eigen::VectorXd& area_m2,
                                                 const BandMatrix& rho, const BandMatrix& source) {
  std::map<std::vector<double>, std::size_t> number_of;
  std::vector<std::vector<Index>> elements;
  std::vector<double> last;
  std::size_t number = 0;
  for (Index i = 0; i < rho.rows(); ++i) {
    const double* const row = rho.data() + i * rho.cols();
    if (i == 0 || !std::equal(last.begin(), last.end(), row)) {
      last.assign(row, row + rho.cols());
      number = number_of.emplace(last, elements.size()).first->second;
      if (number == elements.size()) elements.emplace_back();
      if (elements.size() > kMostGroups) return {};
    }
    elements[number].push_back(i);
  }
  std::vector<ReflectanceGroup> groups;
  groups.reserve(elements.size());
  for (std::vector<Index>& of_one : elements)
    groups.emplace_back(std::move(of_one), area_m2, rho, source);
  return groups;
}

}  // namespace truebox

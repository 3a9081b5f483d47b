// SPDX-License-Identifier: BSD-3-Clause
#include "transport/interpolated_product.h"

#include <algorithm>
#include <vector>

#include "transport/band_product.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr Index kSamples = 192;    // elements that columns are chosen by, at first
constexpr int kMostChoices = 4;    // each with more of them
constexpr double kReserve = 0.5;   // of what is allowed: the other elements may be worse
constexpr double kNoSaving = 0.8;  // of the columns: then all of them

// The columns that are asked for on some elements, in units of what they may miss.
Eigen::MatrixXd sample_of(const BandMatrix& x, const std::vector<Index>& elements,
                          const std::vector<Index>& asked, const Eigen::VectorXd& allowed) {
  Eigen::MatrixXd sample(static_cast<Index>(elements.size()), static_cast<Index>(asked.size()));
  for (Index c = 0; c < sample.cols(); ++c) {
    const Index k = asked[static_cast<std::size_t>(c)];
    for (Index r = 0; r < sample.rows(); ++r)
      sample(r, c) = x(elements[static_cast<std::size_t>(r)], k) / allowed[k];
  }
  return sample;
}

// Columns of the sample that the others are combinations of: sample = sample(:, columns) weights.
struct Skeleton {
  std::vector<Index> columns;
  Eigen::MatrixXd weights;
};

// Gram-Schmidt, the worst column next; its coefficients are triangular in the chosen columns.
Skeleton skeleton_of(Eigen::MatrixXd sample) {
  Skeleton skeleton;
  const Index most = std::min(sample.rows(), sample.cols());
  Eigen::MatrixXd coefficients(most, sample.cols());
  Index rank = 0;
  for (; rank < most; ++rank) {
    Index worst = 0;
    if (!(sample.cwiseAbs().colwise().maxCoeff().maxCoeff(&worst) > kReserve)) break;
    const Eigen::VectorXd direction = sample.col(worst).normalized();
    coefficients.row(rank).noalias() = direction.transpose() * sample;
    sample.noalias() -= direction * coefficients.row(rank);
    sample.col(worst).setZero();
    skeleton.columns.push_back(worst);
  }
  const Eigen::MatrixXd triangle = coefficients.topRows(rank)(Eigen::all, skeleton.columns);
  skeleton.weights =
      triangle.triangularView<Eigen::Upper>().solve(coefficients.topRows(rank)).eval();
  return skeleton;
}

BandMatrix some_columns(const BandMatrix& x, const std::vector<Index>& columns) {
  BandMatrix some(x.rows(), static_cast<Index>(columns.size()));
  for (Index i = 0; i < x.rows(); ++i)
    for (Index c = 0; c < some.cols(); ++c) some(i, c) = x(i, columns[static_cast<std::size_t>(c)]);
  return some;
}

// Columns of x and what each column of x is as their combination; nothing of those not asked for.
struct Combination {
  std::vector<Index> columns;
  BandMatrix weights;
};

Combination all_of(const std::vector<Index>& asked, Index columns) {
  Combination all{asked, BandMatrix::Zero(static_cast<Index>(asked.size()), columns)};
  for (std::size_t c = 0; c < asked.size(); ++c) all.weights(static_cast<Index>(c), asked[c]) = 1.0;
  return all;
}

Combination choose(const BandMatrix& x, const std::vector<Index>& elements,
                   const std::vector<Index>& asked, const Eigen::VectorXd& allowed) {
  const Skeleton skeleton = skeleton_of(sample_of(x, elements, asked, allowed));
  const std::size_t rank = skeleton.columns.size();
  if (static_cast<double>(rank) > kNoSaving * static_cast<double>(asked.size()))
    return all_of(asked, x.cols());
  Combination chosen{{}, BandMatrix::Zero(static_cast<Index>(rank), x.cols())};
  for (Index c : skeleton.columns) chosen.columns.push_back(asked[static_cast<std::size_t>(c)]);
  for (std::size_t c = 0; c < asked.size(); ++c)
    for (std::size_t j = 0; j < rank; ++j)
      chosen.weights(static_cast<Index>(j), asked[c]) =
          skeleton.weights(static_cast<Index>(j), static_cast<Index>(c)) * allowed[asked[c]] /
          allowed[chosen.columns[j]];
  for (std::size_t j = 0; j < rank; ++j) {  // themselves, without rounding
    chosen.weights.col(chosen.columns[j]).setZero();
    chosen.weights(static_cast<Index>(j), chosen.columns[j]) = 1.0;
  }
  return chosen;
}

// What combinations miss on all elements.
struct Missed {
  Eigen::VectorXd by;        // max |x - combination| of each column; NaN if there is one
  std::vector<Index> where;  // the element
};

Missed missed_by(const BandMatrix& x, const BandMatrix& combined, const std::vector<Index>& asked) {
  Missed missed{Eigen::VectorXd::Zero(x.cols()),
                std::vector<Index>(static_cast<std::size_t>(x.cols()), 0)};
  for (Index i = 0; i < x.rows(); ++i)
    for (Index k : asked) {
      const double by = std::abs(x(i, k) - combined(i, k));
      if (by <= missed.by[k]) continue;
      missed.by[k] = by;
      missed.where[static_cast<std::size_t>(k)] = i;
    }
  return missed;
}

// Columns that their combination misses by more than is allowed become their own.
void add_columns(const std::vector<Index>& failed, Combination& chosen) {
  const auto old = static_cast<Index>(chosen.columns.size());
  const auto more = static_cast<Index>(failed.size());
  chosen.columns.insert(chosen.columns.end(), failed.begin(), failed.end());
  chosen.weights.conservativeResize(old + more, chosen.weights.cols());
  chosen.weights.bottomRows(more).setZero();
  for (Index f = 0; f < more; ++f) {
    chosen.weights.col(failed[static_cast<std::size_t>(f)]).setZero();
    chosen.weights(old + f, failed[static_cast<std::size_t>(f)]) = 1.0;
  }
}

}  // namespace

InterpolatedProducts::InterpolatedProducts(const ExchangeOperator& exchange) : exchange_(exchange) {
  const Index n = exchange.size(), count = std::min(n, kSamples);
  for (Index r = 0; r < count; ++r) sample_.push_back(r * n / count);
}

InterpolatedProduct InterpolatedProducts::operator()(const BandMatrix& x,
                                                     const Eigen::VectorXd& allowed) {
  std::vector<Index> asked;
  for (Index k = 0; k < x.cols(); ++k)
    if (allowed[k] >= 0.0) asked.push_back(k);
  InterpolatedProduct found;
  Combination chosen;
  for (int choice = 1;; ++choice) {
    chosen = choose(x, sample_, asked, allowed);
    found.missed = Eigen::VectorXd::Zero(x.cols());
    if (chosen.columns.size() == asked.size()) break;
    const Missed missed =
        missed_by(x, tall_product(some_columns(x, chosen.columns), chosen.weights), asked);
    found.missed = missed.by;
    std::vector<Index> failed, where;
    for (Index k : asked)
      if (!(missed.by[k] <= allowed[k])) {
        failed.push_back(k);
        where.push_back(missed.where[static_cast<std::size_t>(k)]);
      }
    if (failed.empty()) break;
    std::sort(where.begin(), where.end());
    where.erase(std::unique(where.begin(), where.end()), where.end());
    sample_.insert(sample_.end(), where.begin(), where.end());
    if (choice < kMostChoices) continue;
    add_columns(failed, chosen);
    for (Index k : failed) found.missed[k] = 0.0;
    break;
  }
  found.products = static_cast<Index>(chosen.columns.size());
  found.product =
      chosen.columns.empty()
          ? BandMatrix(BandMatrix::Zero(x.rows(), x.cols()))
          : tall_product(exchange_.product(some_columns(x, chosen.columns)), chosen.weights);
  return found;
}

}  // namespace truebox

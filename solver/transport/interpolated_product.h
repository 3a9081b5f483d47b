// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "transport/exchange_operator.h"

namespace truebox {

/// S X by products of a few columns of X, the others' as combinations of theirs.
struct InterpolatedProduct {
  BandMatrix product;         ///< n x columns; 0 in columns that were not asked for
  Eigen::VectorXd missed;     ///< of each column, max |x - combination|
  Eigen::Index products = 0;  ///< columns that S was multiplied by
};

/// Finds such products, one after the other: what it learns about the elements serves the next.
class InterpolatedProducts {
 public:
  explicit InterpolatedProducts(const ExchangeOperator& exchange);

  /// Columns of `x` with a negative `allowed` are not asked for; of the others each is a
  /// combination of multiplied ones up to `allowed`, in every element:
  ///   |S x_k - product_k|_i <= (row sum of S)_i missed_k,   missed_k <= allowed_k.
  /// The columns are chosen by pivoted Gram-Schmidt on a sample of elements; the rest is checked on
  /// all elements. Those where it fails join the sample, a few times; then columns that still fail
  /// are multiplied, too. Source: Cheng, Gimbutas, Martinsson & Rokhlin (2005).
  InterpolatedProduct operator()(const BandMatrix& x, const Eigen::VectorXd& allowed);

 private:
  const ExchangeOperator& exchange_;
  std::vector<Eigen::Index> sample_;
};

}  // namespace truebox

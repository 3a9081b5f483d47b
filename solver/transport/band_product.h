// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "mesh/smooth_field.h"

namespace truebox {

/// Y = S X: symmetric n x n exchange areas times n x m, all bands in one pass over S; rows in
/// parallel. The inner loop is compiled for several instruction sets and chosen at run time.
BandMatrix band_product(const Eigen::MatrixXd& symmetric, const BandMatrix& x);

/// Rows of a matrix that is 0 in all others: `elements` ascending, x a row for each of them.
struct ElementBlock {
  const std::vector<Eigen::Index>& elements;
  BandMatrix x;
};

/// S [X_1 X_2 ...], in one pass over S; of each block only its elements' columns of S are read.
BandMatrix block_product(const Eigen::MatrixXd& symmetric, const std::vector<ElementBlock>& blocks);

/// Y = W X: the first k columns of W times k x m, few columns, rows in parallel, by the same inner
/// loop.
BandMatrix tall_product(const BandMatrix& tall, const BandMatrix& x);
/// The same in memory that is there already, where y has that size.
void tall_product(const BandMatrix& tall, const BandMatrix& x, BandMatrix& y);

}  // namespace truebox

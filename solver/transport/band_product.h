// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "mesh/smooth_field.h"

namespace truebox {

/// Y = S X: symmetric n x n exchange areas times n x m, all bands in one pass over S; rows in
/// parallel. The inner loop is compiled for several instruction sets and chosen at run time.
BandMatrix band_product(const Eigen::MatrixXd& symmetric, const BandMatrix& x);

/// Y = W X: the first k columns of W times k x m, few columns, rows in parallel, by the same inner
/// loop.
BandMatrix tall_product(const BandMatrix& tall, const BandMatrix& x);

}  // namespace truebox

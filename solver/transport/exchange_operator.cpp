// SPDX-License-Identifier: BSD-3-Clause
#include "transport/exchange_operator.h"

#include "transport/band_product.h"

namespace truebox {

BandMatrix DenseExchange::product(const BandMatrix& x) const {
  return band_product(factors_.exchange_area_m2, x);
}

void DenseExchange::row(Eigen::Index i, Eigen::Ref<Eigen::VectorXd> values) const {
  values = factors_.exchange_area_m2.col(i);
}

}  // namespace truebox

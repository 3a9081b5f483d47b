// SPDX-License-Identifier: BSD-3-Clause
#include "transport/exchange_operator.h"

#include "transport/band_product.h"

namespace truebox {

using Eigen::Index;

BandMatrix ExchangeOperator::product_of_blocks(const std::vector<ElementBlock>& blocks) const {
  Index columns = 0, place = 0;
  for (const ElementBlock& block : blocks) columns += block.x.cols();
  BandMatrix x = BandMatrix::Zero(size(), columns);
  for (const ElementBlock& block : blocks) {
    for (Index r = 0; r < block.x.rows(); ++r)
      x.row(block.elements[static_cast<std::size_t>(r)]).segment(place, block.x.cols()) =
          block.x.row(r);
    place += block.x.cols();
  }
  return product(x);
}

BandMatrix DenseExchange::product_of_blocks(const std::vector<ElementBlock>& blocks) const {
  return block_product(factors_.exchange_area_m2, blocks);
}

BandMatrix DenseExchange::product(const BandMatrix& x) const {
  return band_product(factors_.exchange_area_m2, x);
}

void DenseExchange::row(Eigen::Index i, Eigen::Ref<Eigen::VectorXd> values) const {
  values = factors_.exchange_area_m2.col(i);
}

}  // namespace truebox

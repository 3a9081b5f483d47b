// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <memory>
#include <utility>
#include <vector>

#include "mesh/smooth_field.h"
#include "transport/form_factors.h"

namespace truebox {

struct ElementBlock;

/// The symmetric matrix S of exchange areas S_ij = A_i F_ij (m^2), n x n, as the solvers use it:
/// held in memory, or made anew for every pass.
class ExchangeOperator {
 public:
  virtual ~ExchangeOperator() = default;

  virtual const Eigen::VectorXd& area_m2() const = 0;
  /// max_i sum_j F_ij.
  virtual double row_sum_max() const = 0;
  /// S X: n x n times n x bands, all bands in one pass.
  virtual BandMatrix product(const BandMatrix& x) const = 0;
  /// S [X_1 X_2 ...] of matrices that are 0 but for a few elements, each in its own columns.
  virtual BandMatrix product_of_blocks(const std::vector<ElementBlock>& blocks) const;
  /// Row i of S, which is its column.
  virtual void row(Eigen::Index i, Eigen::Ref<Eigen::VectorXd> values) const = 0;

  Eigen::Index size() const { return area_m2().size(); }
};

/// Form factors that are held in memory: borrowed, they must outlive the operator, or its own.
class DenseExchange final : public ExchangeOperator {
 public:
  explicit DenseExchange(const FormFactors& factors) : factors_(factors) {}
  explicit DenseExchange(std::unique_ptr<FormFactors> factors)
      : owned_(std::move(factors)), factors_(*owned_) {}

  const Eigen::VectorXd& area_m2() const override { return factors_.area_m2; }
  double row_sum_max() const override { return factors_.summary.row_sum_max; }
  BandMatrix product(const BandMatrix& x) const override;
  BandMatrix product_of_blocks(const std::vector<ElementBlock>& blocks) const override;
  void row(Eigen::Index i, Eigen::Ref<Eigen::VectorXd> values) const override;

 private:
  std::unique_ptr<FormFactors> owned_;
  const FormFactors& factors_;
};

}  // namespace truebox

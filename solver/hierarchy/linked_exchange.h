// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "hierarchy/link_refinement.h"

namespace truebox {

/// Exchange areas as links between groups, symmetric by construction:
///   S_ij = s_i s_j A_i A_j sum of the kernels of links between groups of i and groups of j.
/// A product gathers what each group sends (sums of A s x, bottom up), lets the links exchange, and
/// hands it down again: O(elements + links) for each band, all bands at once.
/// Source: Hanrahan, Salzman & Aupperle (1991), push and pull.
class LinkedExchange final : public ExchangeOperator {
 public:
  /// Elements that are not in the tree see nothing.
  LinkedExchange(ElementTree tree, Eigen::VectorXd area_m2, const std::vector<Link>& links);

  const Eigen::VectorXd& area_m2() const override { return area_m2_; }
  double row_sum_max() const override { return row_sum_max_; }
  BandMatrix product(const BandMatrix& x) const override;
  void row(Eigen::Index i, Eigen::Ref<Eigen::VectorXd> values) const override;

  /// sum_j F_ij of each element.
  Eigen::VectorXd row_sums() const;

  /// Scales s until rows sum to 1: symmetric, never negative. Rows that hold
  /// less than `least_row` are left alone. Source: Sinkhorn & Knopp (1967).
  struct Repair {
    double largest_change = 0.0;  ///< of any S_ij, at most
    double residual_max = 0.0;    ///< |sum_j F_ij - 1| afterwards
  };
  Repair close_rows(double least_row, bool closed);

  std::size_t links() const { return half_links_; }
  std::size_t bytes() const;

 private:
  struct HalfLink {
    std::uint32_t source;
    float kernel_per_m2;
  };

  void set_row_sum_max();

  ElementTree tree_;
  Eigen::VectorXd area_m2_, scale_;
  std::vector<std::size_t> first_;  // of each node, into half_links of that receiver
  std::vector<HalfLink> half_;
  std::size_t half_links_ = 0;
  double row_sum_max_ = 0.0;
};

}  // namespace truebox

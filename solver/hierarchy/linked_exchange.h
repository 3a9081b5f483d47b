// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "hierarchy/link_refinement.h"

namespace truebox {

/// Exchange areas as links between groups, symmetric by construction:
///   S_ij = s_i s_j sum of m_i' C m_j over the links between groups of i and groups of j,
/// m the moments of an element in the frame of the group, C the link's coefficients; of a constant
/// link A_i A_j times the kernel. A product gathers what each group sends (moments of s x, bottom
/// up), lets the links exchange, and hands it down again: O(elements + links) for each band, eight
/// bands at once. Polynomials are kept from being negative at 4 x 4 points of each group, corners
/// included: what may be left between these is of no consequence for row_sum_max.
/// Sources: Hanrahan, Salzman & Aupperle (1991), push and pull; GroupBasis.
class LinkedExchange final : public ExchangeOperator {
 public:
  /// Elements that are not in the tree see nothing.
  LinkedExchange(std::shared_ptr<const GroupBasis> groups, Eigen::VectorXd area_m2, Links links);

  const Eigen::VectorXd& area_m2() const override { return area_m2_; }
  double row_sum_max() const override { return row_sum_max_; }
  BandMatrix product(const BandMatrix& x) const override;
  void row(Eigen::Index i, Eigen::Ref<Eigen::VectorXd> values) const override;

  /// sum_j F_ij of each element.
  Eigen::VectorXd row_sums() const;

  /// Scales s until rows sum to 1, or until no s changes by more than `accuracy`: symmetric, never
  /// negative. Rows that hold less than `least_row` are left alone. Source: Sinkhorn & Knopp
  /// (1967).
  struct Repair {
    double largest_change = 0.0;  ///< of any S_ij, at most
    double residual_max = 0.0;    ///< |sum_j F_ij - 1| afterwards
  };
  Repair close_rows(double least_row, bool closed, double accuracy = 1e-10);

  std::size_t links() const { return links_; }
  std::size_t bytes() const;  ///< of links, and of the groups' numbers during a product

 private:
  struct HalfLink {
    std::uint32_t source;
    float kernel_per_m2;
  };
  struct HalfPolynomial {
    std::uint32_t source;
    std::uint16_t degree;
    std::uint16_t is_mirrored;  // the receiver is the link's b
    std::size_t first;
  };
  template <int Width>
  class Product;

  void spread_to_elements(std::size_t node, const std::vector<double>& of_node,
                          Eigen::Ref<Eigen::VectorXd> values) const;

  std::shared_ptr<const GroupBasis> groups_;
  Eigen::VectorXd area_m2_, scale_;
  std::vector<std::size_t> first_, first_polynomial_;  // of each node, as receiver
  std::vector<HalfLink> half_;
  std::vector<HalfPolynomial> half_polynomial_;
  std::vector<float> coefficients_per_m2_;
  std::size_t links_ = 0;
  int degree_ = 0;  // the largest of any link
  double row_sum_max_ = 0.0;
};

}  // namespace truebox

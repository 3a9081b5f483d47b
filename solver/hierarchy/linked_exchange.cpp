// SPDX-License-Identifier: BSD-3-Clause
#include "hierarchy/linked_exchange.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace truebox {
namespace {

using Eigen::Index;

constexpr int kRepairSweeps = 60;
constexpr double kMostChange = 2.0;  // of a row in one sweep

}  // namespace

LinkedExchange::LinkedExchange(ElementTree tree, Eigen::VectorXd area_m2,
                               const std::vector<Link>& links)
    : tree_(std::move(tree)),
      area_m2_(std::move(area_m2)),
      scale_(Eigen::VectorXd::Zero(area_m2_.size())),
      first_(tree_.nodes.size() + 1, 0),
      half_(2 * links.size()),
      half_links_(links.size()) {
  for (std::uint32_t patch : tree_.order) scale_[patch] = 1.0;
  for (const Link& link : links) {
    ++first_[link.a + 1];
    ++first_[link.b + 1];
  }
  for (std::size_t k = 1; k < first_.size(); ++k) first_[k] += first_[k - 1];
  std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
  for (const Link& link : links) {
    half_[next[link.a]++] = {link.b, link.kernel_per_m2};
    half_[next[link.b]++] = {link.a, link.kernel_per_m2};
  }
  set_row_sum_max();
}

BandMatrix LinkedExchange::product(const BandMatrix& x) const {
  const Index m = x.cols();
  const std::size_t count = tree_.nodes.size();
  BandMatrix sent(static_cast<Index>(count), m), met(static_cast<Index>(count), m);
  for (std::size_t k = count; k-- > 0;) {
    const ElementNode& node = tree_.nodes[k];
    const auto row = static_cast<Index>(k);
    if (node.is_leaf()) {
      const Index i = tree_.order[node.begin];
      sent.row(row) = area_m2_[i] * scale_[i] * x.row(i);
    } else {
      sent.row(row) = sent.row(node.left) + sent.row(node.right);
    }
  }
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 256), [&](const auto& range) {
    for (std::size_t k = range.begin(); k < range.end(); ++k) {
      double* const out = met.data() + static_cast<Index>(k) * m;
      std::fill(out, out + m, 0.0);
      for (std::size_t l = first_[k]; l < first_[k + 1]; ++l) {
        const double* const in = sent.data() + static_cast<Index>(half_[l].source) * m;
        const double kernel = half_[l].kernel_per_m2;
        for (Index b = 0; b < m; ++b) out[b] += kernel * in[b];
      }
    }
  });
  BandMatrix y = BandMatrix::Zero(x.rows(), m);
  for (std::size_t k = 0; k < count; ++k) {
    const ElementNode& node = tree_.nodes[k];
    const auto row = static_cast<Index>(k);
    if (node.is_leaf()) {
      const Index i = tree_.order[node.begin];
      y.row(i) = area_m2_[i] * scale_[i] * met.row(row);
    } else {
      met.row(node.left) += met.row(row);
      met.row(node.right) += met.row(row);
    }
  }
  return y;
}

void LinkedExchange::row(Index i, Eigen::Ref<Eigen::VectorXd> values) const {
  values.setZero();
  if (scale_[i] == 0.0) return;
  // Down from the root to the element: links of all groups on the way.
  std::uint32_t at = 0;
  const std::uint32_t leaf = tree_.leaf_of[static_cast<std::size_t>(i)];
  while (true) {
    for (std::size_t l = first_[at]; l < first_[at + 1]; ++l)
      for (std::uint32_t j : tree_.patches_of(tree_.nodes[half_[l].source]))
        values[j] += half_[l].kernel_per_m2;
    if (at == leaf) break;
    at = leaf < tree_.nodes[at].right ? tree_.nodes[at].left : tree_.nodes[at].right;
  }
  values = (values.array() * area_m2_.array() * scale_.array() * (area_m2_[i] * scale_[i])).eval();
}

Eigen::VectorXd LinkedExchange::row_sums() const {
  return product(BandMatrix::Ones(area_m2_.size(), 1)).col(0).cwiseQuotient(area_m2_);
}

void LinkedExchange::set_row_sum_max() { row_sum_max_ = row_sums().maxCoeff(); }

LinkedExchange::Repair LinkedExchange::close_rows(double least_row, bool closed) {
  const Eigen::VectorXd before = scale_;
  const Eigen::VectorXd unscaled = row_sums();
  const auto is_mended = [&](Index i) { return scale_[i] > 0.0 && unscaled[i] >= least_row; };
  Repair repair;
  for (int sweep = 0; sweep < kRepairSweeps; ++sweep) {
    const Eigen::VectorXd sums = row_sums();
    double change = 0.0;
    for (Index i = 0; i < scale_.size(); ++i) {
      if (!is_mended(i) || (!closed && sums[i] <= 1.0)) continue;
      // Half a step: the other half comes from the columns.
      const double step = std::sqrt(std::clamp(1.0 / sums[i], 1.0 / kMostChange, kMostChange));
      scale_[i] *= step;
      change = std::max(change, std::abs(step - 1.0));
    }
    if (change < 1e-10) break;
  }
  double largest = 1.0, smallest = 1.0;
  for (Index i = 0; i < scale_.size(); ++i)
    if (is_mended(i)) {
      largest = std::max(largest, scale_[i] / before[i]);
      smallest = std::min(smallest, scale_[i] / before[i]);
    }
  repair.largest_change = std::max(largest * largest - 1.0, 1.0 - smallest * smallest);
  const Eigen::VectorXd after = row_sums();
  for (Index i = 0; i < after.size(); ++i)
    if (scale_[i] > 0.0)
      repair.residual_max =
          std::max(repair.residual_max, closed ? std::abs(after[i] - 1.0) : after[i] - 1.0);
  set_row_sum_max();
  return repair;
}

std::size_t LinkedExchange::bytes() const {
  return half_.size() * sizeof(HalfLink) + first_.size() * sizeof(std::size_t) +
         tree_.nodes.size() * sizeof(ElementNode);
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "hierarchy/linked_exchange.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "transport/many_targets.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr int kRepairSweeps = 60;
constexpr double kMostChange = 2.0;  // of a row in one sweep
constexpr int kMostBands = 8;        // of a pass

// Where the links of each node as receiver begin; both of its ends receive.
template <class AnyLink>
std::vector<std::size_t> starts(const std::vector<AnyLink>& links, std::size_t nodes,
                                std::vector<std::size_t>& first) {
  first.assign(nodes + 1, 0);
  for (const AnyLink& link : links) {
    ++first[link.a + 1];
    ++first[link.b + 1];
  }
  for (std::size_t k = 1; k < first.size(); ++k) first[k] += first[k - 1];
  return {first.begin(), first.end() - 1};
}

// out += C in, or its transpose: n x n coefficients, those of a row next to each other, Width
// numbers a term.
template <int Width>
[[gnu::always_inline]] inline void add_coupled_terms(const float* c, int n, bool is_mirrored,
                                                     const double* in, double* out) {
  for (int k = 0; k < n; ++k) {
    const float* const row = c + k * n;
    if (is_mirrored) {
      for (int m = 0; m < n; ++m)
        for (int b = 0; b < Width; ++b)
          out[m * Width + b] += static_cast<double>(row[m]) * in[k * Width + b];
    } else {
      double sum[Width] = {};
      for (int m = 0; m < n; ++m)
        for (int b = 0; b < Width; ++b) sum[b] += static_cast<double>(row[m]) * in[m * Width + b];
      for (int b = 0; b < Width; ++b) out[k * Width + b] += sum[b];
    }
  }
}

// Clones are made of functions, not of templates.
TRUEBOX_MANY_TARGETS void add_one(const float* c, int n, bool is_mirrored, const double* in,
                                  double* out) {
  add_coupled_terms<1>(c, n, is_mirrored, in, out);
}
TRUEBOX_MANY_TARGETS void add_four(const float* c, int n, bool is_mirrored, const double* in,
                                   double* out) {
  add_coupled_terms<4>(c, n, is_mirrored, in, out);
}
TRUEBOX_MANY_TARGETS void add_eight(const float* c, int n, bool is_mirrored, const double* in,
                                    double* out) {
  add_coupled_terms<8>(c, n, is_mirrored, in, out);
}

template <int Width>
void add_coupled(const float* c, int n, bool is_mirrored, const double* in, double* out) {
  if constexpr (Width == 1)
    add_one(c, n, is_mirrored, in, out);
  else if constexpr (Width == 4)
    add_four(c, n, is_mirrored, in, out);
  else if constexpr (Width == 8)
    add_eight(c, n, is_mirrored, in, out);
  else
    add_coupled_terms<Width>(c, n, is_mirrored, in, out);
}

}  // namespace

// One pass over the links for Width columns, of which the last may be wanting.
template <int Width>
class LinkedExchange::Product {
 public:
  explicit Product(const LinkedExchange& of)
      : of_(of),
        groups_(*of.groups_),
        terms_(static_cast<std::size_t>(terms_of(of.degree_))),
        sent_(groups_.tree.nodes.size() * terms_ * Width),
        met_(sent_.size()) {}

  // Columns of y = S x from `first` on.
  void run(const BandMatrix& x, BandMatrix& y, Index first) {
    columns_ = std::min<Index>(Width, x.cols() - first);
    gather(x, first);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, groups_.tree.nodes.size(), 256),
                      [&](const auto& range) {
                        for (std::size_t k = range.begin(); k < range.end(); ++k) exchange(k);
                      });
    hand_down(y, first);
  }

 private:
  double* at(std::vector<double>& values, std::size_t node) const {
    return values.data() + node * terms_ * Width;
  }

  // Moments of what each group sends, children before parents.
  void gather(const BandMatrix& x, Index first) {
    std::fill(sent_.begin(), sent_.end(), 0.0);
    for (std::size_t k = groups_.tree.nodes.size(); k-- > 0;) {
      const ElementNode& node = groups_.tree.nodes[k];
      double* const out = at(sent_, k);
      if (node.is_leaf()) {
        const Index i = groups_.tree.order[node.begin];
        for (std::size_t t = 0; t < terms_; ++t) {
          const double moment = of_.scale_[i] * groups_.moments_m2(i, static_cast<Index>(t));
          for (Index b = 0; b < columns_; ++b)
            out[static_cast<Index>(t) * Width + b] = moment * x(i, first + b);
        }
      } else {
        for (std::size_t child : {node.left, node.right})
          groups_.template push<Width>(child, of_.degree_, at(sent_, child), out);
      }
    }
  }

  void exchange(std::size_t node) {
    double* const out = at(met_, node);
    std::fill(out, out + terms_ * Width, 0.0);
    double sum[Width] = {};
    for (std::size_t l = of_.first_[node]; l < of_.first_[node + 1]; ++l) {
      const double* const in = at(sent_, of_.half_[l].source);
      const double kernel = of_.half_[l].kernel_per_m2;
      for (int b = 0; b < Width; ++b) sum[b] += kernel * in[b];
    }
    std::copy(sum, sum + Width, out);
    for (std::size_t l = of_.first_polynomial_[node]; l < of_.first_polynomial_[node + 1]; ++l) {
      const HalfPolynomial& half = of_.half_polynomial_[l];
      const int n = terms_of(half.degree);
      add_coupled<Width>(of_.coefficients_per_m2_.data() + half.first, n, half.is_mirrored != 0,
                         at(sent_, half.source), out);
    }
  }

  void hand_down(BandMatrix& y, Index first) {
    for (std::size_t k = 0; k < groups_.tree.nodes.size(); ++k) {
      const ElementNode& node = groups_.tree.nodes[k];
      const double* const in = at(met_, k);
      if (!node.is_leaf()) {
        for (std::size_t child : {node.left, node.right})
          groups_.template pull<Width>(child, of_.degree_, in, at(met_, child));
        continue;
      }
      const Index i = groups_.tree.order[node.begin];
      for (Index b = 0; b < columns_; ++b) {
        double sum = 0.0;
        for (Index t = 0; t < static_cast<Index>(terms_); ++t)
          sum += groups_.moments_m2(i, t) * in[t * Width + b];
        y(i, first + b) = of_.scale_[i] * sum;
      }
    }
  }

  const LinkedExchange& of_;
  const GroupBasis& groups_;
  std::size_t terms_;
  Index columns_ = Width;
  std::vector<double> sent_, met_;
};

LinkedExchange::LinkedExchange(std::shared_ptr<const GroupBasis> groups, Eigen::VectorXd area_m2,
                               Links links)
    : groups_(std::move(groups)),
      area_m2_(std::move(area_m2)),
      scale_(Eigen::VectorXd::Zero(area_m2_.size())),
      half_(2 * links.links.size()),
      half_polynomial_(2 * links.polynomial.size()),
      coefficients_per_m2_(std::move(links.coefficients_per_m2)),
      links_(links.size()) {
  for (std::uint32_t patch : groups_->tree.order) scale_[patch] = 1.0;
  std::vector<std::size_t> next = starts(links.links, groups_->tree.nodes.size(), first_);
  for (const Link& link : links.links) {
    half_[next[link.a]++] = {link.b, link.kernel_per_m2};
    half_[next[link.b]++] = {link.a, link.kernel_per_m2};
  }
  next = starts(links.polynomial, groups_->tree.nodes.size(), first_polynomial_);
  for (const PolynomialLink& link : links.polynomial) {
    const auto degree = static_cast<std::uint16_t>(link.degree);
    half_polynomial_[next[link.a]++] = {link.b, degree, 0, link.first};
    half_polynomial_[next[link.b]++] = {link.a, degree, 1, link.first};
    degree_ = std::max(degree_, static_cast<int>(link.degree));
  }
  row_sum_max_ = row_sums().maxCoeff();
}

BandMatrix LinkedExchange::product(const BandMatrix& x) const {
  BandMatrix y = BandMatrix::Zero(x.rows(), x.cols());
  const auto run = [&]<int Width>(Product<Width> pass) {
    for (Index first = 0; first < x.cols(); first += Width) pass.run(x, y, first);
  };
  if (x.cols() == 1)
    run(Product<1>(*this));
  else if (x.cols() == 2)
    run(Product<2>(*this));
  else if (x.cols() <= 4)
    run(Product<4>(*this));
  else
    run(Product<kMostBands>(*this));
  return y;
}

void LinkedExchange::row(Index i, Eigen::Ref<Eigen::VectorXd> values) const {
  values.setZero();
  if (scale_[i] == 0.0) return;
  const ElementTree& tree = groups_->tree;
  const auto terms = static_cast<std::size_t>(terms_of(degree_));
  // Up from the element to the root: links of all groups on the way, and its moments there.
  std::vector<std::uint32_t> way = {0};
  const std::uint32_t leaf = tree.leaf_of[static_cast<std::size_t>(i)];
  while (way.back() != leaf) {
    const ElementNode& node = tree.nodes[way.back()];
    way.push_back(leaf < node.right ? node.left : node.right);
  }
  std::vector<double> moments(terms), of_source(terms);
  for (std::size_t t = 0; t < terms; ++t)
    moments[t] = scale_[i] * groups_->moments_m2(i, static_cast<Index>(t));
  for (;; way.pop_back()) {
    const std::uint32_t at = way.back();
    for (std::size_t l = first_[at]; l < first_[at + 1]; ++l) {
      const double kernel = half_[l].kernel_per_m2;
      for (std::uint32_t j : tree.patches_of(tree.nodes[half_[l].source]))
        values[j] += moments[0] * kernel * area_m2_[j];
    }
    for (std::size_t l = first_polynomial_[at]; l < first_polynomial_[at + 1]; ++l) {
      const HalfPolynomial& half = half_polynomial_[l];
      const auto n = static_cast<std::size_t>(terms_of(half.degree));
      std::fill(of_source.begin(), of_source.end(), 0.0);
      for (std::size_t k = 0; k < n; ++k)
        for (std::size_t m = 0; m < n; ++m)
          of_source[m] +=
              moments[k] *
              static_cast<double>(
                  coefficients_per_m2_[half.first + (half.is_mirrored ? m * n + k : k * n + m)]);
      spread_to_elements(half.source, of_source, values);
    }
    if (at == 0) break;
    std::vector<double> of_parent(terms, 0.0);
    groups_->push<1>(at, degree_, moments.data(), of_parent.data());
    moments = std::move(of_parent);
  }
  values.array() *= scale_.array();
}

void LinkedExchange::spread_to_elements(std::size_t node, const std::vector<double>& of_node,
                                        Eigen::Ref<Eigen::VectorXd> values) const {
  const ElementNode& group = groups_->tree.nodes[node];
  if (group.is_leaf()) {
    const Index j = groups_->tree.order[group.begin];
    for (std::size_t t = 0; t < of_node.size(); ++t)
      values[j] += of_node[t] * groups_->moments_m2(j, static_cast<Index>(t));
    return;
  }
  for (std::size_t child : {group.left, group.right}) {
    std::vector<double> of_child(of_node.size(), 0.0);
    groups_->pull<1>(child, degree_, of_node.data(), of_child.data());
    spread_to_elements(child, of_child, values);
  }
}

Eigen::VectorXd LinkedExchange::row_sums() const {
  return product(BandMatrix::Ones(area_m2_.size(), 1)).col(0).cwiseQuotient(area_m2_);
}

LinkedExchange::Repair LinkedExchange::close_rows(double least_row, bool closed, double accuracy) {
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
    if (change < accuracy) break;
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
  row_sum_max_ = after.maxCoeff();
  return repair;
}

std::size_t LinkedExchange::bytes() const {
  return half_.size() * sizeof(HalfLink) + half_polynomial_.size() * sizeof(HalfPolynomial) +
         coefficients_per_m2_.size() * sizeof(float) + 2 * first_.size() * sizeof(std::size_t) +
         2 * groups_->tree.nodes.size() * static_cast<std::size_t>(terms_of(degree_)) * kMostBands *
             sizeof(double);
}

}  // namespace truebox

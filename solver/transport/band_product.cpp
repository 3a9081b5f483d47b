// SPDX-License-Identifier: BSD-3-Clause
#include "transport/band_product.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstring>
#include <vector>

#include "transport/many_targets.h"

namespace truebox {
namespace {

constexpr Eigen::Index kBands = 8;  // one panel: a cache line of doubles
constexpr Eigen::Index kRows = 4;

using Panel = double __attribute__((vector_size(kBands * sizeof(double))));

// sums[r] = sum_j s[r][j] x[j] for four rows and one panel of eight bands.
TRUEBOX_MANY_TARGETS
void four_rows(const double* s0, const double* s1, const double* s2, const double* s3,
               const double* panel, Eigen::Index n, double* sums) {
  Panel a{}, b{}, c{}, d{}, x;
  for (Eigen::Index j = 0; j < n; ++j) {
    std::memcpy(&x, panel + j * kBands, sizeof x);
    a += s0[j] * x;
    b += s1[j] * x;
    c += s2[j] * x;
    d += s3[j] * x;
  }
  std::memcpy(sums, &a, sizeof a);
  std::memcpy(sums + kBands, &b, sizeof b);
  std::memcpy(sums + 2 * kBands, &c, sizeof c);
  std::memcpy(sums + 3 * kBands, &d, sizeof d);
}

// Panels of eight bands, one after the other, zeros where bands end.
std::vector<double> packed(const BandMatrix& x) {
  const Eigen::Index n = x.rows(), m = x.cols(), panels = (m + kBands - 1) / kBands;
  std::vector<double> values(static_cast<std::size_t>(panels * n * kBands), 0.0);
  for (Eigen::Index panel = 0; panel < panels; ++panel) {
    const Eigen::Index first = panel * kBands, count = std::min(kBands, m - first);
    for (Eigen::Index j = 0; j < n; ++j)
      std::copy_n(x.data() + j * m + first, count, values.data() + (panel * n + j) * kBands);
  }
  return values;
}

// `count` rows, `stride` apart, of each as many numbers as x has rows.
BandMatrix product_of_rows(const double* rows, Eigen::Index count, Eigen::Index stride,
                           const BandMatrix& x) {
  const Eigen::Index n = x.rows(), m = x.cols(), panels = (m + kBands - 1) / kBands;
  const std::vector<double> panel_values = packed(x);
  BandMatrix y(count, m);
  tbb::parallel_for(
      tbb::blocked_range<Eigen::Index>(0, (count + kRows - 1) / kRows, 8), [&](const auto& range) {
        double sums[kRows * kBands];
        // A block of rows stays in cache while the panels pass over it.
        for (Eigen::Index panel = 0; panel < panels; ++panel)
          for (Eigen::Index block = range.begin(); block < range.end(); ++block) {
            const Eigen::Index first = block * kRows;
            // The last block repeats a row.
            const auto row = [&](Eigen::Index r) {
              return rows + std::min(first + r, count - 1) * stride;
            };
            four_rows(row(0), row(1), row(2), row(3), panel_values.data() + panel * n * kBands, n,
                      sums);
            const Eigen::Index bands = std::min(kBands, m - panel * kBands);
            for (Eigen::Index r = 0; r < kRows && first + r < count; ++r)
              std::copy_n(sums + r * kBands, bands, y.data() + (first + r) * m + panel * kBands);
          }
      });
  return y;
}

}  // namespace

// S is symmetric: its columns are its rows, and contiguous.
BandMatrix band_product(const Eigen::MatrixXd& symmetric, const BandMatrix& x) {
  return product_of_rows(symmetric.data(), symmetric.rows(), symmetric.rows(), x);
}

BandMatrix tall_product(const BandMatrix& tall, const BandMatrix& x) {
  return product_of_rows(tall.data(), tall.rows(), tall.cols(), x);
}

}  // namespace truebox

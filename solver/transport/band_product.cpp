// SPDX-License-Identifier: BSD-3-Clause
#include "transport/band_product.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstring>
#include <vector>

namespace truebox {
namespace {

constexpr Eigen::Index kBands = 8;  // one panel: a cache line of doubles
constexpr Eigen::Index kRows = 4;

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define TRUEBOX_MANY_TARGETS \
  __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define TRUEBOX_MANY_TARGETS
#endif

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

}  // namespace

BandMatrix band_product(const Eigen::MatrixXd& symmetric, const BandMatrix& x) {
  const Eigen::Index n = symmetric.rows(), m = x.cols();
  const Eigen::Index panels = (m + kBands - 1) / kBands;
  std::vector<double> packed(static_cast<std::size_t>(panels * n * kBands), 0.0);
  for (Eigen::Index j = 0; j < n; ++j)
    for (Eigen::Index k = 0; k < m; ++k)
      packed[static_cast<std::size_t>((k / kBands * n + j) * kBands + k % kBands)] = x(j, k);
  BandMatrix y(n, m);
  tbb::parallel_for(
      tbb::blocked_range<Eigen::Index>(0, (n + kRows - 1) / kRows, 8), [&](const auto& range) {
        double sums[kRows * kBands];
        // A block of rows stays in cache while the panels pass over it.
        for (Eigen::Index panel = 0; panel < panels; ++panel)
          for (Eigen::Index block = range.begin(); block < range.end(); ++block) {
            const Eigen::Index first = block * kRows;
            // S is symmetric: its columns are its rows, and contiguous. The last block repeats a
            // row.
            const auto row = [&](Eigen::Index r) {
              return symmetric.data() + std::min(first + r, n - 1) * n;
            };
            four_rows(row(0), row(1), row(2), row(3), packed.data() + panel * n * kBands, n, sums);
            for (Eigen::Index r = 0; r < kRows && first + r < n; ++r)
              for (Eigen::Index k = 0; k < kBands && panel * kBands + k < m; ++k)
                y(first + r, panel * kBands + k) = sums[r * kBands + k];
          }
      });
  return y;
}

}  // namespace truebox

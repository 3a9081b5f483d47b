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

using Eigen::Index;

constexpr Index kLanes = 8;  // of a vector: a cache line of doubles
constexpr Index kMostPanels = 3;
constexpr Index kMostRows = 16;
constexpr Index kTaskRows = 48;  // of one task: a multiple of every tile's rows

using Vector = double __attribute__((vector_size(kLanes * sizeof(double))));

// out[r][c] = sum_j rows[r][j] x[j][c], c < kPanels * kLanes. The sums stay in registers: as many
// rows and columns at a time as those hold, because each number of a row is then read from memory
// for all columns at once, and each of x for all rows. Source: Goto & van de Geijn (2008).
template <Index kRows, Index kPanels>
[[gnu::always_inline]] inline void multiply_tile(const double* rows, Index stride, const double* x,
                                                 Index n, double* out) {
  Vector sums[kRows][kPanels] = {};
  for (Index j = 0; j < n; ++j) {
    Vector column[kPanels];
#pragma GCC unroll 3
    for (Index p = 0; p < kPanels; ++p)
      std::memcpy(&column[p], x + (j * kPanels + p) * kLanes, sizeof column[p]);
#pragma GCC unroll 16
    for (Index r = 0; r < kRows; ++r) {
      const double s = rows[r * stride + j];
#pragma GCC unroll 3
      for (Index p = 0; p < kPanels; ++p) sums[r][p] += s * column[p];
    }
  }
  std::memcpy(out, sums, sizeof sums);
}

// One column: as fast as the rows come from memory.
template <Index kRows>
[[gnu::always_inline]] inline void multiply_vector(const double* rows, Index stride,
                                                   const double* x, Index n, double* out) {
  Vector sums[kRows] = {};
  const Index whole = n - n % kLanes;
  for (Index j = 0; j < whole; j += kLanes) {
    Vector column, row;
    std::memcpy(&column, x + j, sizeof column);
    for (Index r = 0; r < kRows; ++r) {
      std::memcpy(&row, rows + r * stride + j, sizeof row);
      sums[r] += row * column;
    }
  }
  for (Index r = 0; r < kRows; ++r) {
    double sum = 0.0;
    for (Index lane = 0; lane < kLanes; ++lane) sum += sums[r][lane];
    for (Index j = whole; j < n; ++j) sum += rows[r * stride + j] * x[j];
    out[r] = sum;
  }
}

struct Tile {
  void (*multiply)(const double* rows, Index stride, const double* x, Index n, double* out);
  Index rows;
};

TRUEBOX_MANY_TARGETS
void vector_tile(const double* rows, Index stride, const double* x, Index n, double* out) {
  multiply_vector<4>(rows, stride, x, n, out);
}

// Sixteen registers of four doubles hold no more.
TRUEBOX_MANY_TARGETS
void narrow_tile(const double* rows, Index stride, const double* x, Index n, double* out) {
  multiply_tile<4, 1>(rows, stride, x, n, out);
}

#ifdef TRUEBOX_WIDE_VECTORS
// Thirty-two of eight.
template <Index kRows, Index kPanels>
TRUEBOX_WIDE_VECTORS void wide_tile(const double* rows, Index stride, const double* x, Index n,
                                    double* out) {
  multiply_tile<kRows, kPanels>(rows, stride, x, n, out);
}
#endif

// For so many panels at once; nothing where the machine's registers do not hold them.
Tile tile_of(Index panels) {
#ifdef TRUEBOX_WIDE_VECTORS
  static const bool is_wide = __builtin_cpu_supports("avx512f") != 0;
  if (is_wide && panels == 3) return {wide_tile<8, 3>, 8};
  if (is_wide && panels == 2) return {wide_tile<12, 2>, 12};
  if (is_wide && panels == 1) return {wide_tile<16, 1>, 16};
#endif
  return panels == 1 ? Tile{narrow_tile, 4} : Tile{nullptr, 0};
}

// Columns that are multiplied at once, x packed for that: row by row, zeros where bands end.
struct Group {
  Tile tile;
  Index first = 0, width = 0;  // columns of x; of the packed ones
  std::vector<double> x;
};

std::vector<Group> groups_of(const BandMatrix& x) {
  std::vector<Group> groups;
  const Index n = x.rows(), m = x.cols();
  if (m == 1) return {{{vector_tile, 4}, 0, 1, std::vector<double>(x.data(), x.data() + n)}};
  for (Index first = 0; first < m;) {
    Index panels = std::min((m - first + kLanes - 1) / kLanes, kMostPanels);
    while (!tile_of(panels).multiply) --panels;
    Group group{tile_of(panels), first, panels * kLanes, {}};
    group.x.assign(static_cast<std::size_t>(n * group.width), 0.0);
    const Index count = std::min(group.width, m - first);
    for (Index j = 0; j < n; ++j)
      std::copy_n(x.data() + j * m + first, count, group.x.data() + j * group.width);
    first += group.width;
    groups.push_back(std::move(group));
  }
  return groups;
}

// Rows `begin` to before `end` of y; the last tile starts early enough to be whole.
void multiply_rows(const double* rows, Index stride, Index begin, Index end, const Group& group,
                   BandMatrix& y) {
  double sums[kMostRows * kMostPanels * kLanes];
  const Index n = static_cast<Index>(group.x.size()) / group.width;
  const Index columns = std::min(group.width, y.cols() - group.first);
  for (Index first = begin; first < end; first += group.tile.rows) {
    const Index from = std::max<Index>(0, std::min(first, y.rows() - group.tile.rows));
    group.tile.multiply(rows + from * stride, stride, group.x.data(), n, sums);
    for (Index i = first; i < std::min(first + group.tile.rows, end); ++i)
      std::copy_n(sums + (i - from) * group.width, columns, y.data() + i * y.cols() + group.first);
  }
}

// `count` rows, `stride` apart, of each as many numbers as x has rows.
BandMatrix product_of_rows(const double* rows, Index count, Index stride, const BandMatrix& x) {
  if (count < kMostRows) {  // less than a tile
    BandMatrix padded = BandMatrix::Zero(kMostRows, stride);
    std::copy_n(rows, count * stride, padded.data());
    return product_of_rows(padded.data(), kMostRows, stride, x).topRows(count);
  }
  const std::vector<Group> groups = groups_of(x);
  BandMatrix y(count, x.cols());
  tbb::parallel_for(tbb::blocked_range<Index>(0, (count + kTaskRows - 1) / kTaskRows, 1),
                    [&](const auto& range) {
                      const Index begin = range.begin() * kTaskRows;
                      const Index end = std::min(range.end() * kTaskRows, count);
                      for (Index at = begin; at < end; at += kTaskRows)
                        for (const Group& group : groups)
                          multiply_rows(rows, stride, at, std::min(at + kTaskRows, end), group, y);
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

// SPDX-License-Identifier: BSD-3-Clause
#include "transport/band_product.h"

#include <tbb/blocked_range.h>
#include <tbb/cache_aligned_allocator.h>
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
constexpr Index kShortRun = 8;   // columns that follow each other, below which ends cost the most
constexpr Index kTaskRows = 48;  // of one task: a multiple of every tile's rows

using Vector = double __attribute__((vector_size(kLanes * sizeof(double))));

// out[r][c] += sum_j rows[r][j] x[j][c], c < kPanels * kLanes. The sums stay in registers: as many
// rows and columns at a time as those hold, because each number of a row is then read from memory
// for all columns at once, and each of x for all rows. Source: Goto & van de Geijn (2008).
template <Index kRows, Index kPanels>
[[gnu::always_inline]] inline void multiply_tile(const double* rows, Index stride, const double* x,
                                                 Index n, double* out) {
  Vector sums[kRows][kPanels];
  std::memcpy(sums, out, sizeof sums);
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
    out[r] += sum;
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

// Columns of rows that follow each other, and that x is not 0 for.
struct Run {
  Index begin, count;
};

std::vector<Run> runs_of(const std::vector<Index>& elements) {
  std::vector<Run> runs;
  for (Index element : elements) {
    if (runs.empty() || runs.back().begin + runs.back().count != element)
      runs.push_back({element, 0});
    ++runs.back().count;
  }
  return runs;
}

BandMatrix all_rows_of(const ElementBlock& block, Index rows) {
  BandMatrix all = BandMatrix::Zero(rows, block.x.cols());
  for (Index r = 0; r < block.x.rows(); ++r)
    all.row(block.elements[static_cast<std::size_t>(r)]) = block.x.row(r);
  return all;
}

// Columns that are multiplied at once, x packed for that: row by row, zeros where bands end.
struct Group {
  Tile tile;
  Index first = 0, columns = 0, width = 0;  // of y; of the packed ones
  std::vector<Run> runs;
  std::vector<double, tbb::cache_aligned_allocator<double>> x;  // whole vectors from a cache line
};

// Appends those of x, whose rows are those runs; its first column is column `place` of y.
void add_groups(const BandMatrix& x, const std::vector<Run>& runs, Index place,
                std::vector<Group>& groups) {
  const Index n = x.rows(), m = x.cols();
  if (m == 1) {
    groups.push_back({{vector_tile, 4}, place, 1, 1, runs, {x.data(), x.data() + n}});
    return;
  }
  for (Index first = 0; first < m;) {
    Index panels = std::min((m - first + kLanes - 1) / kLanes, kMostPanels);
    while (!tile_of(panels).multiply) --panels;
    const Index width = panels * kLanes, count = std::min(width, m - first);
    Group group{tile_of(panels), place + first, count, width, runs, {}};
    group.x.assign(static_cast<std::size_t>(n * width), 0.0);
    for (Index j = 0; j < n; ++j)
      std::copy_n(x.data() + j * m + first, count, group.x.data() + j * width);
    first += width;
    groups.push_back(std::move(group));
  }
}

// Rows `begin` to before `end` of y; the last tile starts early enough to be whole.
void multiply_rows(const double* rows, Index stride, Index begin, Index end, const Group& group,
                   BandMatrix& y) {
  alignas(64) double sums[kMostRows * kMostPanels * kLanes];
  for (Index first = begin; first < end; first += group.tile.rows) {
    const Index from = std::max<Index>(0, std::min(first, y.rows() - group.tile.rows));
    std::fill_n(sums, group.tile.rows * group.width, 0.0);
    const double* x = group.x.data();
    for (const Run& run : group.runs) {
      group.tile.multiply(rows + from * stride + run.begin, stride, x, run.count, sums);
      x += run.count * group.width;
    }
    for (Index i = first; i < std::min(first + group.tile.rows, end); ++i)
      std::copy_n(sums + (i - from) * group.width, group.columns,
                  y.data() + i * y.cols() + group.first);
  }
}

// `count` rows, `stride` apart, times the groups' columns.
void multiply(const double* rows, Index count, Index stride, const std::vector<Group>& groups,
              BandMatrix& y) {
  if (count < kMostRows) {  // less than a tile
    BandMatrix padded = BandMatrix::Zero(kMostRows, stride), product;
    std::copy_n(rows, count * stride, padded.data());
    multiply(padded.data(), kMostRows, stride, groups, product);
    y = product.topRows(count);
    return;
  }
  y.resize(count, groups.empty() ? 0 : groups.back().first + groups.back().columns);
  tbb::parallel_for(tbb::blocked_range<Index>(0, (count + kTaskRows - 1) / kTaskRows, 1),
                    [&](const auto& range) {
                      const Index begin = range.begin() * kTaskRows;
                      const Index end = std::min(range.end() * kTaskRows, count);
                      for (Index at = begin; at < end; at += kTaskRows)
                        for (const Group& group : groups)
                          multiply_rows(rows, stride, at, std::min(at + kTaskRows, end), group, y);
                    });
}

void multiply(const double* rows, Index count, Index stride, const BandMatrix& x, BandMatrix& y) {
  std::vector<Group> groups;
  add_groups(x, {{0, x.rows()}}, 0, groups);
  multiply(rows, count, stride, groups, y);
}

}  // namespace

// S is symmetric: its columns are its rows, and contiguous.
BandMatrix band_product(const Eigen::MatrixXd& symmetric, const BandMatrix& x) {
  BandMatrix y;
  multiply(symmetric.data(), symmetric.rows(), symmetric.rows(), x, y);
  return y;
}

BandMatrix block_product(const Eigen::MatrixXd& symmetric,
                         const std::vector<ElementBlock>& blocks) {
  std::vector<Group> groups;
  Index place = 0;
  for (const ElementBlock& block : blocks) {
    std::vector<Run> runs = runs_of(block.elements);
    if (block.x.rows() >= kShortRun * static_cast<Index>(runs.size()))
      add_groups(block.x, runs, place, groups);
    else  // zeros cost less than so many ends
      add_groups(all_rows_of(block, symmetric.rows()), {{0, symmetric.rows()}}, place, groups);
    place += block.x.cols();
  }
  BandMatrix y;
  multiply(symmetric.data(), symmetric.rows(), symmetric.rows(), groups, y);
  return y;
}

void tall_product(const BandMatrix& tall, const BandMatrix& x, BandMatrix& y) {
  multiply(tall.data(), tall.rows(), tall.cols(), x, y);
}

BandMatrix tall_product(const BandMatrix& tall, const BandMatrix& x) {
  BandMatrix y;
  tall_product(tall, x, y);
  return y;
}

}  // namespace truebox

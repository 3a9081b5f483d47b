// SPDX-License-Identifier: BSD-3-Clause
#include "transport/band_systems.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "transport/many_targets.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr Index kLanes = 8;  // a cache line of doubles
constexpr Index kRows = 4;   // that are found together: each L_jt is read once for all of them

using Vector = double __attribute__((vector_size(kLanes * sizeof(double)), may_alias));

constexpr Index row_begin(Index i) { return i * (i + 1) / 2; }

// L_ij of rows i to before i + count, j < before; of what stands there, A_ij.
TRUEBOX_MANY_TARGETS
void eliminate(double* factor, Index i, Index count, Index before) {
  auto* const l = reinterpret_cast<Vector*>(factor);
  Vector* row[kRows];
  for (Index r = 0; r < kRows; ++r) row[r] = l + row_begin(i + std::min(r, count - 1));
  for (Index j = 0; j < before; ++j) {
    const Vector* const other = l + row_begin(j);
    Vector sum[kRows] = {};
    for (Index t = 0; t < j; ++t)
#pragma GCC unroll 4
      for (Index r = 0; r < kRows; ++r) sum[r] += row[r][t] * other[t];
    for (Index r = 0; r < count; ++r) row[r][j] = (row[r][j] - sum[r]) * other[j];
  }
}

// The rest of row i, from column `first`, and 1 / L_ii; false where that is no number.
TRUEBOX_MANY_TARGETS
bool end_row(double* factor, Index i, Index first) {
  auto* const l = reinterpret_cast<Vector*>(factor);
  Vector* const row = l + row_begin(i);
  for (Index j = first; j < i; ++j) {
    const Vector* const other = l + row_begin(j);
    Vector sum = {};
    for (Index t = 0; t < j; ++t) sum += row[t] * other[t];
    row[j] = (row[j] - sum) * other[j];
  }
  Vector square = row[i];
  for (Index t = 0; t < i; ++t) square -= row[t] * row[t];
  bool positive = true;
  for (Index lane = 0; lane < kLanes; ++lane) {
    positive = positive && square[lane] > 0.0;
    row[i][lane] = 1.0 / std::sqrt(square[lane]);
  }
  return positive;
}

TRUEBOX_MANY_TARGETS
void substitute(const double* factor, Index size, double* values) {
  const auto* const l = reinterpret_cast<const Vector*>(factor);
  auto* const v = reinterpret_cast<Vector*>(values);
  for (Index i = 0; i < size; ++i) {
    const Vector* const row = l + row_begin(i);
    Vector sum = {};
    for (Index t = 0; t < i; ++t) sum += row[t] * v[t];
    v[i] = (v[i] - sum) * row[i];
  }
  for (Index i = size; i-- > 0;) {
    const Vector* const row = l + row_begin(i);
    v[i] *= row[i];
    for (Index t = 0; t < i; ++t) v[t] -= row[t] * v[i];
  }
}

}  // namespace

BandSystems::BandSystems(Index bands)
    : bands_(bands), eights_(static_cast<std::size_t>((bands + kLanes - 1) / kLanes)) {}

bool BandSystems::append(const BandMatrix& rows, const BandMatrix& scale) {
  const Index old = size_, size = old + rows.rows();
  std::atomic<bool> positive{true};
  tbb::parallel_for(std::size_t{0}, eights_.size(), [&](std::size_t e) {
    EightBands& eight = eights_[e];
    const Index first = static_cast<Index>(e) * kLanes, count = std::min(kLanes, bands_ - first);
    eight.scale.resize(static_cast<std::size_t>(size), {});
    eight.factor.resize(static_cast<std::size_t>(row_begin(size)));
    double* const s = eight.scale.front().of_band;
    double* const factor = eight.factor.front().of_band;
    for (Index i = old; i < size; ++i)
      std::copy_n(scale.data() + (i - old) * bands_ + first, count, s + i * kLanes);
    for (Index i = old; i < size; ++i)
      for (Index j = 0; j <= i; ++j)
        for (Index lane = 0; lane < kLanes; ++lane)
          factor[(row_begin(i) + j) * kLanes + lane] =
              (i == j ? 1.0 : 0.0) - s[i * kLanes + lane] * rows(i - old, j) * s[j * kLanes + lane];
    for (Index i = old; i < size; i += kRows) {
      const Index more = std::min(kRows, size - i);
      eliminate(factor, i, more, i);
      for (Index r = 0; r < more; ++r)
        if (!end_row(factor, i + r, i)) positive = false;
    }
  });
  size_ = size;
  return positive;
}

BandMatrix BandSystems::solve(const BandMatrix& f) const {
  BandMatrix v(size_, bands_);
  tbb::parallel_for(std::size_t{0}, eights_.size(), [&](std::size_t e) {
    const Index first = static_cast<Index>(e) * kLanes, count = std::min(kLanes, bands_ - first);
    std::vector<Lanes> values(static_cast<std::size_t>(size_), Lanes{});
    double* const of = values.front().of_band;
    for (Index i = 0; i < size_; ++i)
      std::copy_n(f.data() + i * bands_ + first, count, of + i * kLanes);
    substitute(eights_[e].factor.front().of_band, size_, of);
    for (Index i = 0; i < size_; ++i)
      std::copy_n(of + i * kLanes, count, v.data() + i * bands_ + first);
  });
  return v;
}

}  // namespace truebox

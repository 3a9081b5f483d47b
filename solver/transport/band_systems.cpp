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

// L_ij of rows i to before i + count, j < i; of what stands there, A_ij.
TRUEBOX_MANY_TARGETS
void eliminate(Vector* const* l, Index i, Index count) {
  Vector* row[kRows];
  for (Index r = 0; r < kRows; ++r) row[r] = l[i + std::min(r, count - 1)];
  for (Index j = 0; j < i; ++j) {
    const Vector* const other = l[j];
    Vector sum[kRows] = {};
    for (Index t = 0; t < j; ++t)
#pragma GCC unroll 4
      for (Index r = 0; r < kRows; ++r) sum[r] += row[r][t] * other[t];
    for (Index r = 0; r < count; ++r) row[r][j] = (row[r][j] - sum[r]) * other[j];
  }
}

// The rest of row i, from column `first`, and 1 / L_ii; false where that is no number.
TRUEBOX_MANY_TARGETS
bool end_row(Vector* const* l, Index i, Index first) {
  Vector* const row = l[i];
  for (Index j = first; j < i; ++j) {
    const Vector* const other = l[j];
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
void substitute(const Vector* const* l, Index size, Vector* v) {
  for (Index i = 0; i < size; ++i) {
    const Vector* const row = l[i];
    Vector sum = {};
    for (Index t = 0; t < i; ++t) sum += row[t] * v[t];
    v[i] = (v[i] - sum) * row[i];
  }
  for (Index i = size; i-- > 0;) {
    const Vector* const row = l[i];
    v[i] *= row[i];
    for (Index t = 0; t < i; ++t) v[t] -= row[t] * v[i];
  }
}

// The same memory as vectors.
template <class Rows>
Vector* const* vectors(const Rows& rows) {
  return reinterpret_cast<Vector* const*>(rows.data());
}

}  // namespace

BandSystems::BandSystems(Index bands)
    : bands_(bands), eights_(static_cast<std::size_t>((bands + kLanes - 1) / kLanes)) {}

bool BandSystems::append(const BandMatrix& rows, const BandMatrix& scale) {
  std::atomic<bool> positive{true};
  tbb::parallel_for(std::size_t{0}, eights_.size(), [&](std::size_t e) {
    if (!append(rows, scale, static_cast<Index>(e) * kLanes, eights_[e])) positive = false;
  });
  size_ += rows.rows();
  return positive;
}

bool BandSystems::append(const BandMatrix& rows, const BandMatrix& scale, Index first,
                         EightBands& eight) const {
  const Index size = size_ + rows.rows(), count = std::min(kLanes, bands_ - first);
  eight.scale.resize(static_cast<std::size_t>(size), {});
  double* const s = eight.scale.front().of_band;
  for (Index i = size_; i < size; ++i)
    std::copy_n(scale.data() + (i - size_) * bands_ + first, count, s + i * kLanes);
  const Index more = (size * (size + 1) - size_ * (size_ + 1)) / 2;
  eight.memory.push_back(std::make_unique_for_overwrite<Lanes[]>(static_cast<std::size_t>(more)));
  Lanes* row = eight.memory.back().get();
  for (Index i = size_; i < size; row += ++i) {
    eight.rows.push_back(row);
    for (Index j = 0; j <= i; ++j)
      for (Index lane = 0; lane < kLanes; ++lane)
        row[j].of_band[lane] =
            (i == j ? 1.0 : 0.0) - s[i * kLanes + lane] * rows(i - size_, j) * s[j * kLanes + lane];
  }
  bool positive = true;
  for (Index i = size_; i < size; i += kRows) {
    const Index together = std::min(kRows, size - i);
    eliminate(vectors(eight.rows), i, together);
    for (Index r = 0; r < together; ++r)
      positive = end_row(vectors(eight.rows), i + r, i) && positive;
  }
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
    substitute(vectors(eights_[e].rows), size_, reinterpret_cast<Vector*>(of));
    for (Index i = 0; i < size_; ++i)
      std::copy_n(of + i * kLanes, count, v.data() + i * bands_ + first);
  });
  return v;
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "distributed/distributed_rows.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "transport/enclosure.h"
#include "transport/exact_form_factors.h"

namespace truebox::distributed {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kLeastShare = 1e-3;  // of a row that must be open to change, as repair_closure
constexpr int kMostSweeps = 200;
constexpr double kTolerance = 1e-12;

}  // namespace

Partition::Partition(MPI_Comm comm, std::size_t rows)
    : comm_(comm), rows_(static_cast<Index>(rows)) {
  int size = 1;
  MPI_Comm_size(comm, &size);
  MPI_Comm_rank(comm, &rank_);
  for (int r = 0; r < size; ++r) {
    const auto begin = [&](int rank) { return static_cast<int>(rows_ * rank / size); };
    first_.push_back(begin(r));
    count_.push_back(begin(r + 1) - begin(r));
  }
}

void Partition::gather(const double* part, VectorXd& whole) const {
  whole.resize(rows_);
  MPI_Allgatherv(part, static_cast<int>(local()), MPI_DOUBLE, whole.data(), count_.data(),
                 first_.data(), MPI_DOUBLE, comm_);
}

void Partition::gather(const double* part, Index columns, BandMatrix& whole) const {
  whole.resize(rows_, columns);
  std::vector<int> count = count_, first = first_;
  for (int& c : count) c *= static_cast<int>(columns);
  for (int& f : first) f *= static_cast<int>(columns);
  MPI_Allgatherv(part, static_cast<int>(local() * columns), MPI_DOUBLE, whole.data(), count.data(),
                 first.data(), MPI_DOUBLE, comm_);
}

void Partition::gather(const std::vector<char>& part, std::vector<char>& whole) const {
  whole.resize(static_cast<std::size_t>(rows_));
  MPI_Allgatherv(part.data(), static_cast<int>(local()), MPI_CHAR, whole.data(), count_.data(),
                 first_.data(), MPI_CHAR, comm_);
}

double Partition::sum(double value) const {
  MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, MPI_SUM, comm_);
  return value;
}

double Partition::max(double value) const {
  MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, MPI_MAX, comm_);
  return value;
}

DistributedRows::DistributedRows(const Partition& partition, const PatchMesh& mesh,
                                 const Scene& scene, const FormFactorOptions& options)
    : partition_(partition) {
  const double most_rows = partition.max(static_cast<double>(partition.local()));
  const double bytes = most_rows * static_cast<double>(partition.rows()) * sizeof(double);
  if (bytes > static_cast<double>(options.memory_limit_bytes))
    throw std::length_error(std::to_string(mesh.size()) + " elements need " +
                            std::to_string(static_cast<std::size_t>(bytes) >> 20) +
                            " MiB of form factors on a rank, the limit is " +
                            std::to_string(options.memory_limit_bytes >> 20) +
                            " MiB: more ranks would fit them");
  area_m2_.resize(partition.rows());
  for (Index i = 0; i < partition.rows(); ++i)
    area_m2_[i] = mesh.patches[static_cast<std::size_t>(i)].area_m2;
  fill(mesh, scene, options);
  const Visibility visibility(mesh, scene);
  leave_out_buried(mesh, scene, visibility);
  const auto begin = static_cast<std::size_t>(partition.begin());
  VectorXd own_sums = VectorXd::Ones(partition.rows());  // other ranks look after theirs
  own_sums.segment(partition.begin(), partition.local()) =
      row_sums().cwiseQuotient(area_m2_.segment(partition.begin(), partition.local()));
  tested_ = whole_patches(mesh, scene, usable_, own_sums);
  const ClosureTest closure = test_closure(mesh, scene, visibility, tested_, options.seed, begin,
                                           begin + static_cast<std::size_t>(partition.local()));
  summary_.closure_rays =
      static_cast<std::size_t>(partition.sum(static_cast<double>(closure.rays)));
  const bool none_escaped = closure.closed || closure.rays == 0;
  summary_.closed = partition.max(none_escaped ? 0.0 : 1.0) == 0.0 && summary_.closure_rays > 0;
  if (summary_.closed) {
    leave_out_outside(own_sums);
    repair();
  } else {
    const VectorXd sums_m2 = row_sums();
    VectorXd area = area_m2_.segment(partition.begin(), partition.local());
    double covered = 0.0;
    for (Index k = 0; k < area.size(); ++k) {
      const auto patch = begin + static_cast<std::size_t>(k);
      if (!usable_[patch]) continue;
      area[k] = free_area_in_open_m2(mesh, scene, visibility, patch, sums_m2[k]);
      covered += area[k] < mesh.patches[patch].area_m2 ? 1.0 : 0.0;
    }
    partition.gather(area.data(), area_m2_);
    summary_.covered_patches = static_cast<std::size_t>(partition.sum(covered));
  }
  summary_.row_sum_max =
      partition.max(partition.local() > 0
                        ? row_sums()
                              .cwiseQuotient(area_m2_.segment(partition.begin(), partition.local()))
                              .maxCoeff()
                        : 0.0);
}

void DistributedRows::fill(const PatchMesh& mesh, const Scene& scene,
                           const FormFactorOptions& options) {
  summary_.method = FormFactorMethod::exact_visibility;
  ExactFormFactorOptions exact;
  exact.relative_tolerance = options.relative_tolerance;
  exact.occlusion = options.occlusion;
  exact.outline_points = options.outline_points;
  const auto begin = static_cast<std::size_t>(partition_.begin());
  const auto count = static_cast<std::size_t>(partition_.local());
  rows_.resize(partition_.local(), partition_.rows());
  partial_.resize(count);
  std::vector<std::size_t> unoccluded(count), hidden(count);
  stream_form_factors(mesh, scene, exact, begin, begin + count, [&](const FormFactorRow& row) {
    const std::size_t k = row.patch - begin;
    std::copy(row.exchange_area_m2.begin(), row.exchange_area_m2.end(),
              rows_.row(static_cast<Index>(k)).data());
    partial_[k].assign(row.partial.begin(), row.partial.end());
    unoccluded[k] = row.unoccluded;
    hidden[k] = row.hidden;
  });
  // Each pair is in two rows.
  const auto pairs = [&](double in_rows) {
    return static_cast<std::size_t>(0.5 * partition_.sum(in_rows));
  };
  double sums[3] = {};
  for (std::size_t k = 0; k < count; ++k) {
    sums[0] += static_cast<double>(unoccluded[k]);
    sums[1] += static_cast<double>(hidden[k]);
    sums[2] += static_cast<double>(partial_[k].size());
  }
  summary_.pairs_unoccluded = pairs(sums[0]);
  summary_.pairs_hidden = pairs(sums[1]);
  summary_.pairs_sampled = pairs(sums[2]);
}

void DistributedRows::leave_out_buried(const PatchMesh& mesh, const Scene& scene,
                                       const Visibility& visibility) {
  const VectorXd sums = row_sums();
  std::vector<char> sees(static_cast<std::size_t>(partition_.local()));
  for (Index k = 0; k < partition_.local(); ++k) {
    const Index i = partition_.begin() + k;
    sees[static_cast<std::size_t>(k)] =
        sums[k] >= kNearlyEmptyRow * area_m2_[i] ||
        !is_buried(mesh, scene, visibility, static_cast<std::size_t>(i));
  }
  partition_.gather(sees, usable_);
  for (Index j = 0; j < partition_.rows(); ++j) {
    if (usable_[static_cast<std::size_t>(j)]) continue;
    ++summary_.buried_patches;
    rows_.col(j).setZero();
    const Index k = j - partition_.begin();
    if (k >= 0 && k < partition_.local()) rows_.row(k).setZero();
  }
}

// In a closed scene what sees nothing lies outside of it; its row is empty.
void DistributedRows::leave_out_outside(const VectorXd& own_sums) {
  std::vector<char> sees(static_cast<std::size_t>(partition_.local()));
  for (Index k = 0; k < partition_.local(); ++k)
    sees[static_cast<std::size_t>(k)] = usable_[static_cast<std::size_t>(partition_.begin() + k)] &&
                                        own_sums[partition_.begin() + k] >= kEmptyRow;
  partition_.gather(sees, usable_);
  summary_.buried_patches = static_cast<std::size_t>(std::count(usable_.begin(), usable_.end(), 0));
}

// S_ij <- x_i x_j S_ij of the entries in `partial_`, until each row sums to its area.
void DistributedRows::repair() {
  const Index local = partition_.local(), begin = partition_.begin();
  const VectorXd missing = area_m2_.segment(begin, local) - row_sums();
  VectorXd open = VectorXd::Zero(local);
  std::vector<char> is_whole(static_cast<std::size_t>(local));
  std::vector<Index> covered;
  for (Index k = 0; k < local; ++k) {
    const auto patch = static_cast<std::size_t>(begin + k);
    const double lacks = missing[k] / area_m2_[begin + k];
    if (usable_[patch] && !tested_[patch]) covered.push_back(k);
    is_whole[static_cast<std::size_t>(k)] = tested_[patch] && std::abs(lacks) <= kUnmendableRow;
  }
  double before = 0.0, weighted = 0.0, total = 0.0;
  std::vector<char> mended(static_cast<std::size_t>(local));
  for (Index k = 0; k < local; ++k) {
    for (std::uint32_t j : partial_[static_cast<std::size_t>(k)]) open[k] += rows_(k, j);
    mended[static_cast<std::size_t>(k)] =
        is_whole[static_cast<std::size_t>(k)] && open[k] >= kLeastShare * area_m2_[begin + k];
    if (!is_whole[static_cast<std::size_t>(k)]) continue;
    const double error = std::abs(missing[k]) / area_m2_[begin + k];
    before = std::max(before, error);
    weighted += area_m2_[begin + k] * error * error;
    total += area_m2_[begin + k];
  }
  summary_.closure_error_max = partition_.max(before);
  weighted = partition_.sum(weighted);
  total = partition_.sum(total);
  summary_.closure_error_mean = total > 0.0 ? std::sqrt(weighted / total) : 0.0;

  VectorXd x = VectorXd::Ones(partition_.rows()), own = VectorXd::Ones(local);
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    double change = 0.0;
    for (Index k = 0; k < local; ++k) {
      if (!mended[static_cast<std::size_t>(k)]) continue;
      double sum = 0.0;
      for (std::uint32_t j : partial_[static_cast<std::size_t>(k)]) sum += rows_(k, j) * x[j];
      const double wanted = std::clamp((open[k] + missing[k]) / sum, 0.25, 4.0);
      const double next = std::sqrt(own[k] * wanted);
      change = std::max(change, std::abs(next - own[k]));
      own[k] = next;
    }
    partition_.gather(own.data(), x);
    if (partition_.max(change) < kTolerance) break;
  }
  double largest = 0.0, after = 0.0;
  for (Index k = 0; k < local; ++k) {
    for (std::uint32_t j : partial_[static_cast<std::size_t>(k)]) {
      if (rows_(k, j) == 0.0) continue;
      const double by = own[k] * x[j];
      largest = std::max(largest, std::abs(by - 1.0));
      rows_(k, j) *= by;
    }
    if (is_whole[static_cast<std::size_t>(k)])
      after = std::max(after, std::abs(rows_.row(k).sum() / area_m2_[begin + k] - 1));
  }
  VectorXd area = area_m2_.segment(begin, local);
  for (Index k : covered) area[k] = rows_.row(k).sum();
  partition_.gather(area.data(), area_m2_);
  summary_.covered_patches =
      static_cast<std::size_t>(partition_.sum(static_cast<double>(covered.size())));
  summary_.repair_max = partition_.max(largest);
  summary_.closure_residual_max = partition_.max(after);
}

}  // namespace truebox::distributed

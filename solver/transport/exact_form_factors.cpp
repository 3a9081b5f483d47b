// SPDX-License-Identifier: BSD-3-Clause
#include "transport/exact_form_factors.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "transport/exact_pairs.h"

namespace truebox {
namespace {

// What one thread keeps from task to task.
struct Worker {
  explicit Worker(const ExactPairs& pairs) : view(pairs.view()) {}
  ReceiverView view;
  PairPlanner::Memory memory;
};

using PairList = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

// Fills the lower half of the matrix, task by task.
template <class Scalar>
class Filler {
 public:
  using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;

  Filler(const ExactPairs& pairs, Matrix& exchange)
      : pairs_(pairs), exchange_(exchange), partial_(pairs.planner().tasks()) {}

  void run() {
    tbb::enumerable_thread_specific<Worker> workers([&] { return Worker(pairs_); });
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, partial_.size(), 1),
                      [&](const auto& range) {
                        Worker& worker = workers.local();
                        for (std::size_t task = range.begin(); task < range.end(); ++task)
                          fill(task, worker);
                      });
    mirror();
  }

  void report(ExactFormFactors<Scalar>& result) const {
    result.pairs_unoccluded = unoccluded_;
    result.pairs_hidden = hidden_;
    result.partial.assign(static_cast<std::size_t>(exchange_.rows()), {});
    for (const PairList& task : partial_)
      for (const auto& [i, j] : task) result.partial[i].push_back(j);
    for (const auto& row : result.partial) result.pairs_partial += row.size();
  }

 private:
  void fill(std::size_t task, Worker& worker) {
    std::vector<PartialPair> open;
    std::vector<std::uint32_t> occluders_of_open;
    ReceiverView& view = worker.view;
    std::size_t unoccluded = 0, hidden = 0;
    PairPlanner::Visitor visitor;
    std::vector<double> values;
    visitor.unoccluded = [&](auto of_i, auto of_j, bool face_wholly) {
      values.resize(of_j.size());
      const std::size_t begin = pairs_.planner().position_of(of_j);
      for (std::uint32_t i : of_i) {
        pairs_.kernel().exchange_areas_m2(i, begin, face_wholly, values);
        for (std::size_t k = 0; k < values.size(); ++k) {
          unoccluded += values[k] > 0.0;
          exchange_(of_j[k], i) = static_cast<Scalar>(values[k]);
        }
      }
    };
    visitor.partial = [&](std::uint32_t i, std::uint32_t j, auto occluders) {
      PartialPair pair = pairs_.oriented(i, j, occluders);
      pair.first_occluder = static_cast<std::uint32_t>(occluders_of_open.size());
      pair.occluders = static_cast<std::uint32_t>(occluders.size());
      occluders_of_open.insert(occluders_of_open.end(), occluders.begin(), occluders.end());
      open.push_back(pair);
    };
    visitor.hidden = [&](std::size_t count) { hidden += count; };
    pairs_.planner().visit(task, worker.memory, visitor);
    std::sort(open.begin(), open.end(), [](const PartialPair& a, const PartialPair& b) {
      return std::pair(a.receiver, a.source) < std::pair(b.receiver, b.source);
    });
    auto receiver = static_cast<std::uint32_t>(exchange_.rows());
    for (const PartialPair& pair : open) {
      if (pair.receiver != receiver) {
        receiver = pair.receiver;
        view.move_to(pairs_.polygons()[receiver]);
      }
      const double value = pairs_.exchange_m2(
          pair, {occluders_of_open.data() + pair.first_occluder, pair.occluders}, view);
      const auto [i, j] = std::minmax(pair.receiver, pair.source);
      if (value > 0.0) {
        exchange_(j, i) = static_cast<Scalar>(value);
        partial_[task].emplace_back(i, j);
      } else {
        ++hidden;
      }
    }
    unoccluded_ += unoccluded;
    hidden_ += hidden;
  }

  // Copies the lower half up, in blocks that stay in the cache.
  void mirror() {
    constexpr Eigen::Index kBlock = 64;
    tbb::parallel_for(tbb::blocked_range<Eigen::Index>(0, exchange_.rows(), kBlock),
                      [&](const auto& range) {
                        for (Eigen::Index first = 0; first < range.end(); first += kBlock)
                          for (Eigen::Index j = range.begin(); j < range.end(); ++j)
                            for (Eigen::Index i = first; i < std::min(first + kBlock, j); ++i)
                              exchange_(i, j) = exchange_(j, i);
                      });
  }

  const ExactPairs& pairs_;
  Matrix& exchange_;
  std::vector<PairList> partial_;  // of each task
  std::atomic<std::size_t> unoccluded_{0}, hidden_{0};
};

constexpr double kSeesNothing = 1e-4;  // of a row

}  // namespace

template <class Scalar>
double ExactFormFactors<Scalar>::closure_rms() const {
  double weighted = 0.0, total = 0.0;
  for (Eigen::Index i = 0; i < area_m2.size(); ++i) {
    if (!usable[static_cast<std::size_t>(i)]) continue;
    const double error = exchange_area_m2.col(i).template cast<double>().sum() / area_m2[i] - 1.0;
    weighted += area_m2[i] * error * error;
    total += area_m2[i];
  }
  return total > 0.0 ? std::sqrt(weighted / total) : 0.0;
}

template <class Scalar>
ExactFormFactors<Scalar> exact_form_factors(const PatchMesh& mesh, const Scene& scene,
                                            const ExactFormFactorOptions& options,
                                            std::size_t memory_limit_bytes) {
  const std::size_t bytes = mesh.size() * mesh.size() * sizeof(Scalar);
  if (bytes > memory_limit_bytes)
    throw std::length_error(std::to_string(mesh.size()) + " elements need " +
                            std::to_string(bytes >> 20) + " MiB of form factors, the limit is " +
                            std::to_string(memory_limit_bytes >> 20) + " MiB");
  const ExactPairs pairs(mesh, scene, options);
  const auto n = static_cast<Eigen::Index>(mesh.size());
  ExactFormFactors<Scalar> result;
  result.exchange_area_m2.setZero(n, n);
  Filler<Scalar> filler(pairs, result.exchange_area_m2);
  filler.run();
  filler.report(result);
  result.area_m2.resize(n);
  result.usable.assign(mesh.size(), 1);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    result.area_m2[i] = mesh.patches[k].area_m2;
    const double sum = result.exchange_area_m2.col(i).template cast<double>().sum();
    if (sum < kSeesNothing * result.area_m2[i]) result.usable[k] = 0;
  }
  return result;
}

template struct ExactFormFactors<float>;
template struct ExactFormFactors<double>;
template ExactFormFactors<float> exact_form_factors(const PatchMesh&, const Scene&,
                                                    const ExactFormFactorOptions&, std::size_t);
template ExactFormFactors<double> exact_form_factors(const PatchMesh&, const Scene&,
                                                     const ExactFormFactorOptions&, std::size_t);

void stream_form_factors(
    const PatchMesh& mesh, const Scene& scene, const ExactFormFactorOptions& options,
    const std::function<void(std::size_t i, std::span<const double> row_m2)>& visit) {
  stream_form_factors(mesh, scene, options, 0, mesh.size(),
                      [&](const FormFactorRow& row) { visit(row.patch, row.exchange_area_m2); });
}

void stream_form_factors(const PatchMesh& mesh, const Scene& scene,
                         const ExactFormFactorOptions& options, std::size_t begin, std::size_t end,
                         const std::function<void(const FormFactorRow& row)>& visit) {
  const ExactPairs pairs(mesh, scene, options);
  tbb::enumerable_thread_specific<Worker> workers([&] { return Worker(pairs); });
  tbb::parallel_for(tbb::blocked_range<std::size_t>(begin, end, 4), [&](const auto& range) {
    auto& [view, memory] = workers.local();
    std::vector<double> values(mesh.size()), run;
    std::vector<std::uint32_t> partial;
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      std::fill(values.begin(), values.end(), 0.0);
      partial.clear();
      FormFactorRow row;
      row.patch = i;
      PairPlanner::Visitor visitor;
      visitor.hidden = [&](std::size_t count) { row.hidden += count; };
      visitor.unoccluded = [&](auto of_i, auto of_j, bool face_wholly) {
        run.resize(of_j.size());
        pairs.kernel().exchange_areas_m2(of_i[0], pairs.planner().position_of(of_j), face_wholly, run);
        for (std::size_t k = 0; k < run.size(); ++k) {
          values[of_j[k]] = run[k];
          row.unoccluded += run[k] > 0.0;
        }
      };
      visitor.partial = [&](std::uint32_t a, std::uint32_t b, auto occluders) {
        const PartialPair pair = pairs.oriented(std::min(a, b), std::max(a, b), occluders);
        view.move_to(pairs.polygons()[pair.receiver]);
        values[b] = pairs.exchange_m2(pair, occluders, view);
        if (values[b] > 0.0)
          partial.push_back(b);
        else
          ++row.hidden;
      };
      pairs.planner().visit_row(static_cast<std::uint32_t>(i), memory, visitor);
      row.exchange_area_m2 = values;
      row.partial = partial;
      visit(row);
    }
  });
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "transport/exact_form_factors.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "transport/exact_visibility.h"
#include "transport/pair_kernel.h"
#include "transport/pair_planner.h"
#include "transport/shadow_cones.h"

namespace truebox {
namespace {

// A pair that something hides a part of; its blockers are a range of ids kept elsewhere.
struct PartialPair {
  std::uint32_t receiver, source, first_blocker, blockers;
};

// Shadow pyramids from the points of one receiver, made when asked for and kept until the next.
class ShadowCones {
 public:
  ShadowCones(const std::vector<Blocker>& blockers, const PairKernel& kernel, int order)
      : blockers_(blockers), kernel_(kernel), order_(order), entries_(blockers.size()) {}

  void move_to(std::uint32_t receiver) {
    points_ = kernel_.points(receiver, order_);
    ++age_;
  }
  const PairKernel::Points& points() const { return points_; }
  Vec3 point(std::uint32_t k) const { return {points_.x[k], points_.y[k], points_.z[k]}; }

  /// Null if the blocker hides nothing from there.
  const ShadowCone* cone(std::uint32_t blocker, std::uint32_t k) {
    Entry& entry = entries_[blocker];
    if (entry.age != age_) {
      entry.age = age_;
      entry.cones.resize(points_.count);
      entry.usable.resize(points_.count);
      for (std::uint32_t p = 0; p < points_.count; ++p)
        entry.usable[p] = ShadowCone::make(point(p), blockers_[blocker], entry.cones[p]);
    }
    return entry.usable[k] ? &entry.cones[k] : nullptr;
  }

 private:
  struct Entry {
    std::size_t age = 0;
    std::vector<ShadowCone> cones;
    std::vector<char> usable;
  };

  const std::vector<Blocker>& blockers_;
  const PairKernel& kernel_;
  int order_;
  PairKernel::Points points_{};
  std::vector<Entry> entries_;
  std::size_t age_ = 0;
};

// Pairs whose visibility is exact: kernels, planner, and the share of one partial pair.
class ExactPairs {
 public:
  ExactPairs(const PatchMesh& mesh, const Scene& scene, const ExactFormFactorOptions& options)
      : polygons(planar_polygons(mesh)),
        kernel(polygons, options.relative_tolerance),
        planner(mesh, scene, polygons, 1e-9 * scene.diameter_m(), options.occlusion),
        adaptive_{options.relative_tolerance, 200'000},
        outline_points_(options.outline_points) {}

  ShadowCones cones() const {
    return ShadowCones(planner.blockers(), kernel, std::max(2, outline_points_));
  }

  const std::vector<PlanarPolygon> polygons;
  const PairKernel kernel;
  const PairPlanner planner;

  // The smaller patch receives: its points see less of a change.
  PartialPair oriented(std::uint32_t i, std::uint32_t j) const {
    return polygons[j].radius_m < 0.7 * polygons[i].radius_m ? PartialPair{j, i, 0, 0}
                                                             : PartialPair{i, j, 0, 0};
  }

  // `cones` stand at the receiver.
  double exchange_m2(const PartialPair& pair, std::span<const std::uint32_t> blockers,
                     ShadowCones& cones, VisibleParts& parts) const {
    const PlanarPolygon &receiver = polygons[pair.receiver], &source = polygons[pair.source];
    if (outline_points_ == 0)
      return visible_exchange(receiver, source, all_of(blockers), adaptive_).exchange_area_m2;
    const double d2 = (receiver.centroid - source.centroid).squaredNorm();
    const double reach = kFarForCentroids * std::max(receiver.radius_m, source.radius_m);
    const double share = d2 < reach * reach || !above(source, receiver.plane)
                             ? near_share(receiver, source, blockers, cones, parts)
                             : far_share(receiver, source, blockers, cones, parts);
    return share > 0.0 ? share * kernel.exchange_area_m2(pair.receiver, pair.source) : 0.0;
  }

 private:
  static constexpr double kFarForCentroids = 4.0;  // radii: then 1/16 of a hidden share is missed

  static bool above(const PlanarPolygon& polygon, const Plane& plane) {
    return std::all_of(polygon.vertices.begin(), polygon.vertices.end(),
                       [&](const Vec3& v) { return plane.distance_m(v) > 0.0; });
  }

  std::vector<const Blocker*> all_of(std::span<const std::uint32_t> ids) const {
    std::vector<const Blocker*> blockers;
    for (std::uint32_t id : ids) blockers.push_back(&planner.blockers()[id]);
    return blockers;
  }

  double far_share(const PlanarPolygon& receiver, const PlanarPolygon& source,
                   std::span<const std::uint32_t> ids, ShadowCones& cones,
                   VisibleParts& parts) const {
    constexpr std::size_t kMostBlockers = 16;
    if (ids.size() > kMostBlockers) return near_share(receiver, source, ids, cones, parts);
    double seen = 0.0, all = 0.0;
    for (std::uint32_t k = 0; k < cones.points().count; ++k) {
      std::array<const ShadowCone*, kMostBlockers> active;
      std::size_t count = 0;
      for (std::uint32_t id : ids)
        if (const ShadowCone* cone = cones.cone(id, k)) active[count++] = cone;
      const double hidden =
          hidden_share(cones.point(k), receiver.plane.normal, source, {active.data(), count});
      if (hidden < 0.0) return near_share(receiver, source, ids, cones, parts);
      const Vec3 r = source.centroid - cones.point(k);
      const double r2 = r.squaredNorm();
      const double weight = cones.points().weight_m2[k] * receiver.plane.normal.dot(r) *
                            -source.plane.normal.dot(r) / (r2 * r2);
      all += weight;
      seen += weight * (1.0 - hidden);
    }
    return all > 0.0 ? seen / all : 0.0;
  }

  double near_share(const PlanarPolygon& receiver, const PlanarPolygon& source,
                    std::span<const std::uint32_t> ids, ShadowCones& cones,
                    VisibleParts& parts) const {
    const auto blockers = all_of(ids);
    double seen = 0.0, all = 0.0;
    for (std::uint32_t k = 0; k < cones.points().count; ++k) {
      const Vec3 x = cones.point(k);
      const double weight = cones.points().weight_m2[k];
      for (const Polygon& part : parts(x, source.vertices, source.plane, blockers))
        seen += weight * point_to_polygon(x, receiver.plane.normal, part);
      all += weight * point_to_polygon(x, receiver.plane.normal, source.vertices);
    }
    return all > 0.0 ? seen / all : 0.0;
  }

  ExactVisibilityOptions adaptive_;
  int outline_points_;
};

using PairList = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

// Fills the lower half of the matrix, task by task.
template <class Scalar>
class Filler {
 public:
  using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;

  Filler(const ExactPairs& pairs, Matrix& exchange)
      : pairs_(pairs), exchange_(exchange), partial_(pairs.planner.tasks()) {}

  void run() {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, partial_.size(), 1),
                      [&](const auto& range) {
                        ShadowCones cones = pairs_.cones();
                        for (std::size_t task = range.begin(); task < range.end(); ++task)
                          fill(task, cones);
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
  void fill(std::size_t task, ShadowCones& cones) {
    std::vector<PartialPair> open;
    std::vector<std::uint32_t> blockers_of_open;
    std::size_t unoccluded = 0, hidden = 0;
    PairPlanner::Visitor visitor;
    visitor.unoccluded = [&](auto of_i, auto of_j) {
      for (std::uint32_t i : of_i)
        for (std::uint32_t j : of_j) {
          const double value = pairs_.kernel.exchange_area_m2(i, j);
          unoccluded += value > 0.0;
          exchange_(j, i) = static_cast<Scalar>(value);
        }
    };
    visitor.partial = [&](std::uint32_t i, std::uint32_t j, auto blockers) {
      PartialPair pair = pairs_.oriented(i, j);
      pair.first_blocker = static_cast<std::uint32_t>(blockers_of_open.size());
      pair.blockers = static_cast<std::uint32_t>(blockers.size());
      blockers_of_open.insert(blockers_of_open.end(), blockers.begin(), blockers.end());
      open.push_back(pair);
    };
    visitor.hidden = [&](std::size_t count) { hidden += count; };
    pairs_.planner.visit(task, visitor);
    std::sort(open.begin(), open.end(), [](const PartialPair& a, const PartialPair& b) {
      return std::pair(a.receiver, a.source) < std::pair(b.receiver, b.source);
    });
    VisibleParts parts;
    auto receiver = static_cast<std::uint32_t>(exchange_.rows());
    for (const PartialPair& pair : open) {
      if (pair.receiver != receiver) cones.move_to(receiver = pair.receiver);
      const double value = pairs_.exchange_m2(
          pair, {blockers_of_open.data() + pair.first_blocker, pair.blockers}, cones, parts);
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
  tbb::parallel_for(tbb::blocked_range<std::size_t>(begin, end, 4), [&](const auto& range) {
    ShadowCones cones = pairs.cones();
    VisibleParts parts;
    std::vector<double> values(mesh.size());
    std::vector<std::uint32_t> partial;
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      std::fill(values.begin(), values.end(), 0.0);
      partial.clear();
      FormFactorRow row;
      row.patch = i;
      PairPlanner::Visitor visitor;
      visitor.hidden = [&](std::size_t count) { row.hidden += count; };
      visitor.unoccluded = [&](auto of_i, auto of_j) {
        for (std::uint32_t j : of_j) {
          values[j] = pairs.kernel.exchange_area_m2(of_i[0], j);
          row.unoccluded += values[j] > 0.0;
        }
      };
      visitor.partial = [&](std::uint32_t a, std::uint32_t b, auto blockers) {
        const PartialPair pair = pairs.oriented(std::min(a, b), std::max(a, b));
        cones.move_to(pair.receiver);
        values[b] = pairs.exchange_m2(pair, blockers, cones, parts);
        if (values[b] > 0.0)
          partial.push_back(b);
        else
          ++row.hidden;
      };
      pairs.planner.visit_row(static_cast<std::uint32_t>(i), visitor);
      row.exchange_area_m2 = values;
      row.partial = partial;
      visit(row);
    }
  });
}

}  // namespace truebox

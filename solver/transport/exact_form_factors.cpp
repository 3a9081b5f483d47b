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
#include "transport/quadrature.h"
#include "transport/shadow_cones.h"

namespace truebox {
namespace {

// A pair that something hides a part of; its occluders are a range of ids kept elsewhere.
struct PartialPair {
  std::uint32_t receiver, source, first_occluder, occluders;
};

// Rules of 2 x 2, 4 x 4 and 8 x 8 points, or 3 x 3 and 6 x 6.
constexpr int kFinestOrder = 8;

// Shadow cones from the points of one receiver, made when asked for and kept until the next.
class ReceiverView {
 public:
  struct Shadow {
    ShadowCone::Hides hides = ShadowCone::Hides::nothing;
    ShadowCone cone;
  };

  ReceiverView(const PairPlanner& planner, double tolerance_m)
      : occluders_(planner.occluders()), tolerance_m_(tolerance_m) {
    for (auto& entries : entries_) entries.resize(occluders_.size());
  }

  void move_to(const PlanarPolygon& receiver) {
    receiver_ = &receiver;
    ++age_;
  }
  void take_points(int order) {
    order_ = order;
    Rule& rule = rules_[static_cast<std::size_t>(order)];
    if (std::exchange(rule.age, age_) != age_) rule.points = rule.buffer.fill(*receiver_, order);
    points_ = rule.points;
  }
  const PatchPoints& points() const { return points_; }
  int order() const { return order_; }

  std::span<const Shadow> shadows(std::uint32_t occluder) {
    Entry& entry = entries_[static_cast<std::size_t>(order_)][occluder];
    if (entry.age != age_) {
      entry.age = age_;
      entry.shadows.resize(points_.count);
      for (std::uint32_t k = 0; k < points_.count; ++k)
        entry.shadows[k].hides =
            ShadowCone::make(points_.at(k), receiver_->plane.normal, occluders_[occluder],
                             tolerance_m_, entry.shadows[k].cone);
    }
    return entry.shadows;
  }

  ShadowParts parts;
  VisibleParts any_parts;  // where `parts` do not suffice

 private:
  struct Entry {
    std::size_t age = 0;
    std::vector<Shadow> shadows;
  };

  struct Rule {
    std::size_t age = 0;
    PatchPointBuffer buffer;
    PatchPoints points;
  };

  const std::vector<ConvexOccluder>& occluders_;
  double tolerance_m_;
  int order_ = 2;
  const PlanarPolygon* receiver_ = nullptr;
  PatchPoints points_{};
  std::array<Rule, kFinestOrder + 1> rules_;
  std::array<std::vector<Entry>, kFinestOrder + 1> entries_;  // by order, occluder
  std::size_t age_ = 0;
};

// Pairs whose visibility is exact: kernels, planner, and the share of one partial pair.
class ExactPairs {
 public:
  ExactPairs(const PatchMesh& mesh, const Scene& scene, const ExactFormFactorOptions& options)
      : polygons(planar_polygons(mesh)),
        tolerance_m_(1e-9 * scene.diameter_m()),
        planner(mesh, scene, polygons, tolerance_m_, options.occlusion),
        kernel(polygons, planner.order(), options.relative_tolerance, 2.0 * tolerance_m_),
        adaptive_{.relative_tolerance = options.relative_tolerance},
        outline_points_(options.outline_points),
        outline_tolerance_(options.outline_tolerance) {}

  ReceiverView view() const { return ReceiverView(planner, tolerance_m_); }

  const std::vector<PlanarPolygon> polygons;

 private:
  double tolerance_m_;

 public:
  const PairPlanner planner;
  const PairKernel kernel;

  // Shadows move over the source d_source / d_receiver times as fast as a point over the receiver,
  // d the distances from the occluder: the patch receives whose points see less of a change.
  PartialPair oriented(std::uint32_t i, std::uint32_t j,
                       std::span<const std::uint32_t> occluders) const {
    const PlanarPolygon &a = polygons[i], &b = polygons[j];
    double change_i = 0.0, change_j = 0.0;
    for (std::uint32_t id : occluders) {
      const auto [enter, leave] = passage(a.centroid, b.centroid, planner.occluders()[id]);
      change_i = std::max(change_i, (1.0 - leave) / enter);
      change_j = std::max(change_j, enter / (1.0 - leave));
    }
    return change_i * a.radius_m * a.radius_m > change_j * b.radius_m * b.radius_m
               ? PartialPair{j, i, 0, 0}
               : PartialPair{i, j, 0, 0};
  }

  // `view` stands at the receiver.
  double exchange_m2(const PartialPair& pair, std::span<const std::uint32_t> occluders,
                     ReceiverView& view) const {
    if (outline_points_ == 0) return adaptive_exchange_m2(pair, occluders);
    view.take_points(outline_points_);
    Share share = visible_share(pair, occluders, view);
    if (share.roughness == 0.0 && share.mean == 0.0) return 0.0;
    const double whole = kernel.exchange_area_m2(pair.receiver, pair.source);
    const double least = std::min(polygons[pair.receiver].area_m2, polygons[pair.source].area_m2);
    double error = share.roughness;
    for (int order = 2 * outline_points_; order <= kFinestOrder; order *= 2) {
      if (whole * error <= outline_tolerance_ * least) break;
      view.take_points(order);
      const Share finer = visible_share(pair, occluders, view);
      error = std::abs(finer.mean - share.mean);
      share = finer;
    }
    return std::max(0.0, share.mean * whole);  // a share is found by differences, too
  }

 private:
  double adaptive_exchange_m2(const PartialPair& pair,
                              std::span<const std::uint32_t> occluders) const {
    const PlanarPolygon &receiver = polygons[pair.receiver], &source = polygons[pair.source];
    ExactVisibilityOptions options = adaptive_;
    options.absolute_tolerance_m2 =
        kAbsolute * options.relative_tolerance * std::min(receiver.area_m2, source.area_m2);
    std::vector<const ConvexOccluder*> solids;
    for (std::uint32_t id : occluders) solids.push_back(&planner.occluders()[id]);
    if (const auto found = visible_exchange(receiver, source, solids, options))
      return found->exchange_area_m2;
    return visible_exchange(receiver, source, members_of(occluders), options).exchange_area_m2;
  }

  static constexpr double kAbsolute = 0.1;         // of a row that the tolerance is worth to a pair
  static constexpr double kFarForCentroids = 2.0;  // radii; nearer, Lambert of every part

  // Shares of the way from a to b where it enters a solid and leaves it, or would.
  static std::pair<double, double> passage(const Vec3& a, const Vec3& b,
                                           const ConvexOccluder& solid) {
    constexpr double kLeast = 1e-3;
    double enter = kLeast, leave = 1.0 - kLeast;
    for (const Plane& face : solid.faces) {
      const double from = face.distance_m(a), to = face.distance_m(b);
      if (from > 0.0 && to < 0.0) enter = std::max(enter, from / (from - to));
      if (from < 0.0 && to > 0.0) leave = std::min(leave, from / (from - to));
    }
    enter = std::min(enter, 1.0 - kLeast);
    return {enter, std::max(leave, kLeast)};
  }

  static bool above(const PlanarPolygon& polygon, const Plane& plane) {
    return std::all_of(polygon.vertices.begin(), polygon.vertices.end(),
                       [&](const Vec3& v) { return plane.distance_m(v) > 0.0; });
  }

  std::vector<const Blocker*> members_of(std::span<const std::uint32_t> occluders) const {
    std::vector<const Blocker*> blockers;
    for (std::uint32_t id : occluders)
      for (std::uint32_t member : planner.occluders()[id].members)
        blockers.push_back(&planner.blockers()[member]);
    return blockers;
  }

  // Weighted with the kernel; roughness: what a finer rule may change.
  struct Share {
    double mean = 0.0, roughness = 0.0;
  };

  // The highest polynomials that a rule of order x order points sees in each direction, the largest
  // row and column. Linear changes, which the rule integrates, have none from three points on.
  static double roughness(std::span<const double> values, int order) {
    std::array<double, kFinestOrder> highest;
    const GaussRule& rule = gauss_rule(order);
    for (int k = 0; k < order; ++k) {
      double p0 = 1.0, p1 = 2.0 * rule.nodes[k] - 1.0;
      const double x = p1;
      for (int n = 2; n < order; ++n)
        p0 = std::exchange(p1, ((2 * n - 1) * x * p1 - (n - 1) * p0) / n);
      highest[k] = rule.weights[k] * p1;
    }
    double most = 0.0;
    for (int j = 0; j < order; ++j) {
      double row = 0.0, column = 0.0;
      for (int i = 0; i < order; ++i) {
        row += highest[i] * values[static_cast<std::size_t>(j * order + i)];
        column += highest[i] * values[static_cast<std::size_t>(i * order + j)];
      }
      most = std::max({most, std::abs(row), std::abs(column)});
    }
    return most;
  }

  // Of the source, over the points of the view.
  Share visible_share(const PartialPair& pair, std::span<const std::uint32_t> occluders,
                      ReceiverView& view) const {
    const PlanarPolygon &receiver = polygons[pair.receiver], &source = polygons[pair.source];
    const double d2 = (receiver.centroid - source.centroid).squaredNorm();
    const double reach = kFarForCentroids * std::max(receiver.radius_m, source.radius_m);
    const bool near = d2 < reach * reach || !above(source, receiver.plane);
    double seen = 0.0, all = 0.0;
    Share result;
    std::array<double, kFinestOrder * kFinestOrder> shares;
    const int order = view.order();
    const auto block = static_cast<std::uint32_t>(order * order);
    for (std::uint32_t k = 0; k < view.points().count; ++k) {
      const Vec3 x = view.points().at(k), r = source.centroid - x;
      const double r2 = r.squaredNorm();
      const double factor =
          near ? point_to_polygon(x, receiver.plane.normal, source.vertices)
               : receiver.plane.normal.dot(r) * -source.plane.normal.dot(r) / (r2 * r2);
      const double weight = view.points().weight_at(k);
      const double share = share_from(k, factor, near, pair, occluders, view);
      all += weight * factor;
      seen += weight * factor * share;
      shares[k % block] = share;
      if (k % block == block - 1)
        result.roughness = std::max(result.roughness, roughness({shares.data(), block}, order));
    }
    if (all > 0.0) result.mean = seen / all;
    return result;
  }

  // Of the source, seen from one point.
  double share_from(std::uint32_t k, double factor, bool near, const PartialPair& pair,
                    std::span<const std::uint32_t> occluders, ReceiverView& view) const {
    constexpr std::size_t kMostCones = 16;
    std::array<const ShadowCone*, kMostCones> across;
    std::uint32_t cuts = 0;
    std::size_t count = 0;
    bool fits = true;
    for (std::uint32_t id : occluders) {
      const ReceiverView::Shadow& shadow = view.shadows(id)[k];
      if (shadow.hides == ShadowCone::Hides::nothing) continue;
      if (shadow.hides == ShadowCone::Hides::all) return 0.0;
      fits &= shadow.cone.count > 0 && count < kMostCones;
      if (!fits) break;
      const ShadowTest test = test_shadow(shadow.cone, polygons[pair.source]);
      if (test.side == ShadowSide::inside) return 0.0;
      if (test.side == ShadowSide::outside) continue;
      across[count++] = &shadow.cone;
      cuts = test.cuts;
    }
    if (fits && count == 0) return 1.0;
    const PlanarPolygon &receiver = polygons[pair.receiver], &source = polygons[pair.source];
    const Vec3 x = view.points().at(k);
    if (fits && count == 1 && !near) {
      const double hidden =
          view.parts.hidden_share(source, *across[0], cuts, x, receiver.plane.normal);
      if (hidden >= 0.0) return 1.0 - hidden;
    }
    if (fits && view.parts.cut(source.vertices, {across.data(), count})) {
      if (!near)
        return 1.0 - view.parts.hidden_share(x, receiver.plane.normal, source.plane.normal);
      return factor > 0.0 ? view.parts.visible_factor(x, receiver.plane.normal) / factor : 0.0;
    }
    double seen = 0.0;
    for (const Polygon& part :
         view.any_parts(x, source.vertices, source.plane, members_of(occluders)))
      seen += point_to_polygon(x, receiver.plane.normal, part);
    const double all = point_to_polygon(x, receiver.plane.normal, source.vertices);
    return all > 0.0 ? seen / all : 0.0;
  }

  ExactVisibilityOptions adaptive_;
  int outline_points_;
  double outline_tolerance_;
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
                        ReceiverView view = pairs_.view();
                        for (std::size_t task = range.begin(); task < range.end(); ++task)
                          fill(task, view);
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
  void fill(std::size_t task, ReceiverView& view) {
    std::vector<PartialPair> open;
    std::vector<std::uint32_t> occluders_of_open;
    std::size_t unoccluded = 0, hidden = 0;
    PairPlanner::Visitor visitor;
    std::vector<double> values;
    visitor.unoccluded = [&](auto of_i, auto of_j, bool face_wholly) {
      values.resize(of_j.size());
      const std::size_t begin = pairs_.planner.position_of(of_j);
      for (std::uint32_t i : of_i) {
        pairs_.kernel.exchange_areas_m2(i, begin, face_wholly, values);
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
    pairs_.planner.visit(task, visitor);
    std::sort(open.begin(), open.end(), [](const PartialPair& a, const PartialPair& b) {
      return std::pair(a.receiver, a.source) < std::pair(b.receiver, b.source);
    });
    auto receiver = static_cast<std::uint32_t>(exchange_.rows());
    for (const PartialPair& pair : open) {
      if (pair.receiver != receiver) {
        receiver = pair.receiver;
        view.move_to(pairs_.polygons[receiver]);
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
  tbb::parallel_for(tbb::blocked_range<std::size_t>(begin, end, 4), [&](const auto& range) {
    ReceiverView view = pairs.view();
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
        pairs.kernel.exchange_areas_m2(of_i[0], pairs.planner.position_of(of_j), face_wholly, run);
        for (std::size_t k = 0; k < run.size(); ++k) {
          values[of_j[k]] = run[k];
          row.unoccluded += run[k] > 0.0;
        }
      };
      visitor.partial = [&](std::uint32_t a, std::uint32_t b, auto occluders) {
        const PartialPair pair = pairs.oriented(std::min(a, b), std::max(a, b), occluders);
        view.move_to(pairs.polygons[pair.receiver]);
        values[b] = pairs.exchange_m2(pair, occluders, view);
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

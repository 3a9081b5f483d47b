// SPDX-License-Identifier: BSD-3-Clause
#include "hierarchy/link_refinement.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <deque>
#include <mutex>
#include <stdexcept>

#include "hierarchy/group_kernel.h"
#include "transport/enclosure.h"
#include "transport/pair_kernel.h"

namespace truebox {
namespace {

constexpr double kFarEnough = 0.5;  // gap over radius from which 16 x 16 points see the kernel
constexpr double kElementTolerance = 1e-4;
constexpr std::size_t kTasks = 256;  // each starts from all blockers again
constexpr int kFirstRays = 8;

double gap_m(const ElementNode& a, const ElementNode& b) { return a.box.exteriorDistance(b.box); }

}  // namespace

NodeLight node_light(const ElementTree& tree, const Eigen::VectorXd& area_m2,
                     const BandMatrix& radiosity, const Eigen::VectorXd& mean_irradiance) {
  const Eigen::Index m = radiosity.cols();
  const auto count = static_cast<Eigen::Index>(tree.nodes.size());
  BandMatrix first(count, m), second(count, m);  // integrals of B and B^2
  NodeLight light{std::vector<double>(tree.nodes.size()), std::vector<double>(tree.nodes.size())};
  for (Eigen::Index k = count; k-- > 0;) {
    const ElementNode& node = tree.nodes[static_cast<std::size_t>(k)];
    if (node.is_leaf()) {
      const std::uint32_t patch = tree.order[node.begin];
      first.row(k) = area_m2[patch] * radiosity.row(patch);
      second.row(k) = area_m2[patch] * radiosity.row(patch).cwiseAbs2();
    } else {
      first.row(k) = first.row(node.left) + first.row(node.right);
      second.row(k) = second.row(node.left) + second.row(node.right);
    }
    double mean = 0.0, spread = 0.0;
    for (Eigen::Index b = 0; b < m; ++b) {
      if (!(mean_irradiance[b] > 0.0)) continue;
      const double value = first(k, b) / node.area_m2;
      mean = std::max(mean, std::abs(value) / mean_irradiance[b]);
      spread =
          std::max(spread, std::sqrt(std::max(0.0, second(k, b) / node.area_m2 - value * value)) /
                               mean_irradiance[b]);
    }
    light.mean[static_cast<std::size_t>(k)] = mean;
    light.spread[static_cast<std::size_t>(k)] = spread;
  }
  return light;
}

// Walks down pairs of nodes; blockers that are still in question are on a stack.
class LinkRefinement::Walk {
 public:
  Walk(const LinkRefinement& parent, const NodeLight& light, const LinkOptions& options)
      : parent_(parent), light_(light), options_(options) {}

  Links found;

  void run(Pair pair) {
    stack_ = parent_.culling_.blockers();
    descend(pair, 0);
  }

  // One step from the full list of blockers: the pairs that are left go to `queue`.
  void step(Pair pair, std::deque<Pair>& queue) {
    queue_ = &queue;
    run(pair);
    queue_ = nullptr;
  }

 private:
  struct Visible {
    double share = 1.0;  // kernel-weighted
    double spread = 0.0;
  };

  const ElementNode& node(std::uint32_t k) const { return parent_.tree_.nodes[k]; }

  void go_on(Pair pair, std::size_t from) {
    if (queue_)
      queue_->push_back(pair);
    else
      descend(pair, from);
  }

  void descend(Pair pair, std::size_t from) {
    const ElementNode &a = node(pair.a), &b = node(pair.b);
    if (pair.a == pair.b) {
      if (a.one_normal) return;
      go_on({a.left, a.left}, from);
      go_on({a.left, a.right}, from);
      go_on({a.right, a.right}, from);
      return;
    }
    if (a.one_normal && b.one_normal && a.normal.dot(b.normal) > 1.0 - 1e-12) return;
    const double tolerance_m = parent_.culling_.tolerance_m();
    const ShaftEnd end_a = a.end_of_shaft(), end_b = b.end_of_shaft();
    if (end_a.is_behind(b.horizon, tolerance_m) || end_b.is_behind(a.horizon, tolerance_m)) return;
    ++found.tried;
    const std::size_t to = stack_.size();
    if (!parent_.culling_.keep_between(end_a, end_b, stack_, from, to))
      ++found.hidden;
    else if (a.is_leaf() && b.is_leaf())
      link_elements(pair, stack_.size() > to);
    else if (!link_groups(pair, stack_.size() > to))
      divide(pair, to);
    stack_.resize(to);
  }

  void divide(Pair pair, std::size_t from) {
    const ElementNode &a = node(pair.a), &b = node(pair.b);
    if (b.is_leaf() || (!a.is_leaf() && a.radius_m >= b.radius_m)) {
      go_on({a.left, pair.b}, from);
      go_on({a.right, pair.b}, from);
    } else {
      go_on({pair.a, b.left}, from);
      go_on({pair.a, b.right}, from);
    }
  }

  // Rays between points of the two groups, each point in turn, until `most` are cast.
  Visible visible_share(Pair pair, int most) {
    const ElementNode &a = node(pair.a), &b = node(pair.b);
    const GroupSamples &from = parent_.samples_[pair.a], &to = parent_.samples_[pair.b];
    const std::uint64_t bits =
        hash(options_.seed ^ hash((static_cast<std::uint64_t>(pair.a) << 32) | pair.b));
    double seen = 0.0, total = 0.0;
    int cast = 0;
    for (int k = 0; k < most; ++k) {
      if (k == most / 2 && k >= kFirstRays && (seen == 0.0 || seen == total)) break;
      const auto i = static_cast<int>((5 * static_cast<unsigned>(k) + (bits & 15)) % 16);
      const auto j = static_cast<int>(
          (7 * static_cast<unsigned>(k) + (bits >> 8) + static_cast<unsigned>(k / 16)) % 16);
      const Vec3 x = from.point(a, i), y = to.point(b, j), r = y - x;
      const Vec3 nx = from.normal(i), ny = to.normal(j);
      const double cos_a = nx.dot(r), cos_b = -ny.dot(r);
      if (cos_a <= 0.0 || cos_b <= 0.0) continue;
      const double r2 = r.squaredNorm();
      const double weight =
          static_cast<double>(from.weight[i]) * to.weight[j] * cos_a * cos_b / (r2 * r2);
      total += weight;
      ++cast;
      if (!parent_.visibility_.occluded(x, nx, y, ny)) seen += weight;
    }
    found.rays += static_cast<std::size_t>(cast);
    if (total == 0.0) return {0.0, 0.0};
    const double share = seen / total;
    // Rays that all agree may still have missed something: one more might not.
    return {share, std::max(std::sqrt(share * (1.0 - share)), 0.5 / (cast + 1))};
  }

  // From the points of an element to a whole other one.
  double mean_factor(std::uint32_t from, const PlanarPolygon& to) const {
    const GroupSamples& samples = parent_.samples_[from];
    double factor = 0.0;
    for (int k = 0; k < kGroupSamples; ++k) {
      const Vec3 point = samples.point(node(from), k);
      if (to.plane.distance_m(point) > 0.0)
        factor += samples.weight[k] * point_to_polygon(point, node(from).normal, to.vertices);
    }
    return factor;
  }

  void link_elements(Pair pair, bool may_be_hidden) {
    const std::uint32_t i = parent_.tree_.order[node(pair.a).begin];
    const std::uint32_t j = parent_.tree_.order[node(pair.b).begin];
    Visible visible;
    if (may_be_hidden) {
      visible = visible_share(pair, options_.rays);
      if (visible.share == 0.0) return;
      ++found.sampled;
    }
    // Near ones by Lambert's formula from points of the smaller; from a gap on, points alone.
    const ElementNode &a = node(pair.a), &b = node(pair.b);
    const bool is_near = gap_m(a, b) < kFarEnough * std::max(a.radius_m, b.radius_m);
    double kernel_per_m2 = 0.0;
    if (!is_near)
      kernel_per_m2 =
          kernel_statistics(parent_.samples_[pair.a], parent_.samples_[pair.b], b.centre - a.centre)
              .mean;
    else if (options_.accurate_elements)
      kernel_per_m2 =
          exchange_area_m2(parent_.polygons_[i], parent_.polygons_[j], kElementTolerance) /
          (a.area_m2 * b.area_m2);
    else
      kernel_per_m2 = a.area_m2 < b.area_m2 ? mean_factor(pair.a, parent_.polygons_[j]) / b.area_m2
                                            : mean_factor(pair.b, parent_.polygons_[i]) / a.area_m2;
    if (kernel_per_m2 > 0.0) add(pair, visible.share * kernel_per_m2);
  }

  // What one side gets wrong, relative to the mean irradiance, times the root of its area share.
  double error(std::uint32_t receiver, std::uint32_t source, double spread_over_receiver,
               double spread) const {
    return node(source).area_m2 *
           (spread_over_receiver * light_.mean[source] + spread * light_.spread[source]) *
           std::sqrt(node(receiver).area_m2 / node(0).area_m2);
  }

  bool link_groups(Pair pair, bool may_be_hidden) {
    const ElementNode &a = node(pair.a), &b = node(pair.b);
    KernelStatistics kernel =
        kernel_statistics(parent_.samples_[pair.a], parent_.samples_[pair.b], b.centre - a.centre);
    // Too near for the points: the exchange is at most the smaller area, and may be all of it.
    const double most = 1.0 / std::max(a.area_m2, b.area_m2);
    if (gap_m(a, b) < kFarEnough * std::max(a.radius_m, b.radius_m)) {
      kernel.mean = std::min(kernel.mean, most);
      kernel.spread = kernel.spread_a = kernel.spread_b = 0.5 * most;
    }
    const double limit = options_.error_of_a_link;
    const auto errors = [&] {
      return std::pair(error(pair.a, pair.b, kernel.spread_a, kernel.spread),
                       error(pair.b, pair.a, kernel.spread_b, kernel.spread));
    };
    auto [error_a, error_b] = errors();
    if (std::max(error_a, error_b) > limit) return false;
    if (kernel.mean == 0.0) return true;
    if (may_be_hidden) {
      const Visible visible = visible_share(pair, kGroupSamples);
      const double by_visibility = visible.spread * kernel.mean;
      kernel.mean *= visible.share;
      kernel.spread = std::hypot(kernel.spread, by_visibility);
      kernel.spread_a = std::hypot(kernel.spread_a, by_visibility);
      kernel.spread_b = std::hypot(kernel.spread_b, by_visibility);
      std::tie(error_a, error_b) = errors();
      if (std::max(error_a, error_b) > limit) return false;
      ++found.sampled;
    }
    found.sum_of_squares += error_a * error_a + error_b * error_b;
    if (kernel.mean > 0.0) add(pair, kernel.mean);
    return true;
  }

  void add(Pair pair, double kernel_per_m2) {
    found.links.push_back({pair.a, pair.b, static_cast<float>(kernel_per_m2)});
  }

  const LinkRefinement& parent_;
  const NodeLight& light_;
  const LinkOptions& options_;
  std::vector<std::uint32_t> stack_;
  std::deque<Pair>* queue_ = nullptr;
};

LinkRefinement::LinkRefinement(const PatchMesh& mesh, const Visibility& visibility,
                               const ElementTree& tree, const ShaftCulling& culling,
                               std::uint64_t seed)
    : visibility_(visibility),
      tree_(tree),
      culling_(culling),
      samples_(group_samples(mesh, tree, seed)),
      polygons_(planar_polygons(mesh)) {}

Links LinkRefinement::refine(const NodeLight& light, const LinkOptions& options) const {
  // Breadth first until there is work for all threads.
  std::deque<Pair> queue = {{0, 0}};
  Walk first(*this, light, options);
  while (!queue.empty() && queue.size() < kTasks) {
    const Pair pair = queue.front();
    queue.pop_front();
    first.step(pair, queue);
  }
  const std::vector<Pair> tasks(queue.begin(), queue.end());
  std::vector<Links> found(tasks.size() + 1);
  found.back() = std::move(first.found);
  std::atomic<std::size_t> done{0}, links{0};
  std::mutex progress_lock;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, tasks.size(), 4), [&](const auto& range) {
    for (std::size_t t = range.begin(); t < range.end() && links <= options.most_links; ++t) {
      Walk walk(*this, light, options);
      walk.run(tasks[t]);
      links += walk.found.links.size();
      found[t] = std::move(walk.found);
    }
    const std::size_t count = done += range.end() - range.begin();
    if (!options.progress) return;
    const std::lock_guard guard(progress_lock);
    options.progress("links", static_cast<double>(count) / static_cast<double>(tasks.size()));
  });
  if (links > options.most_links)
    throw std::length_error("more than " + std::to_string(options.most_links) + " links");
  Links all;
  all.links.reserve(links + found.back().links.size());
  for (Links& part : found) {
    all.links.insert(all.links.end(), part.links.begin(), part.links.end());
    part.links = {};
    all.tried += part.tried;
    all.hidden += part.hidden;
    all.sampled += part.sampled;
    all.rays += part.rays;
    all.sum_of_squares += part.sum_of_squares;
  }
  return all;
}

}  // namespace truebox

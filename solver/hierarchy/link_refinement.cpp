// SPDX-License-Identifier: BSD-3-Clause
#include "hierarchy/link_refinement.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <deque>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <tuple>

#include "hierarchy/kernel_fit.h"
#include "transport/enclosure.h"
#include "transport/shadow_cones.h"

namespace truebox {
namespace {

constexpr double kFarEnough = 0.5;   // gap over radius from which 16 x 16 points see the kernel
constexpr std::size_t kTasks = 256;  // each starts from all blockers again
constexpr int kFirstRays = 8;
constexpr std::size_t kMostOutlines = 12;  // blockers: beyond, rays are faster
constexpr double kLeastShadow = 0.03;      // deviation of the visible share where there is an edge
constexpr double kMissed = 0.2;            // of a partly hidden element, if one point looks
constexpr double kFarForCentroids = 2.0;   // radii; nearer, Lambert of every part
constexpr double kFilled = 1e-6;           // of a group's area, that its rectangle may exceed it by

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
  Walk(const LinkRefinement& parent, const NodeLight& light, const LinkOptions& options,
       std::span<const Link> known)
      : parent_(parent), light_(light), options_(options), known_(known) {}

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
  // Kernel-weighted visible share of two groups, its deviation over all pairs of points and over
  // the points of either, each averaged over the other.
  struct Visible {
    double share = 1.0;
    double spread = 0.0, spread_a = 0.0, spread_b = 0.0;
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
    ++found.counts.tried;
    const std::size_t to = stack_.size();
    if (!parent_.culling_.keep_between(end_a, end_b, stack_, from, to))
      ++found.counts.hidden;
    else if (a.is_leaf() && b.is_leaf())
      link_elements(pair, to);
    else if (!link_groups(pair, to))
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
    found.counts.rays += static_cast<std::size_t>(cast);
    if (total == 0.0) return {0.0, 0.0, 0.0, 0.0};
    const double share = seen / total;
    // Rays that all agree may still have missed something: one more might not.
    const double spread = std::max(std::sqrt(share * (1.0 - share)), 0.5 / (cast + 1));
    return {share, spread, spread, spread};
  }

  // The polygon that a group fills; null if it fills none.
  const PlanarPolygon* outline_of(std::uint32_t k, std::optional<PlanarPolygon>& made) const {
    if (node(k).is_leaf()) return &parent_.polygons_[parent_.tree_.order[node(k).begin]];
    const GroupFrame& f = parent_.basis_.frames[k];
    if (!f.is_flat || std::abs(4.0 * f.half_u.norm() * f.half_v.norm() - node(k).area_m2) >
                          kFilled * node(k).area_m2)
      return nullptr;
    made.emplace(Polygon{f.centre - f.half_u - f.half_v, f.centre + f.half_u - f.half_v,
                         f.centre + f.half_u + f.half_v, f.centre - f.half_u + f.half_v});
    return &*made;
  }

  // Gauss points of an element, or of the rectangle that a group fills, with weights.
  struct WeightedPoint {
    Vec3 at;
    double weight;
  };
  void find_points(std::uint32_t k) {
    points_.clear();
    if (node(k).is_leaf() && order_ == 1) {
      points_.push_back({node(k).centre, 1.0});
      return;
    }
    if (node(k).is_leaf()) {
      const std::uint32_t patch = parent_.tree_.order[node(k).begin];
      const PatchPoints p = of_element_.fill(parent_.polygons_[patch], order_);
      for (std::uint32_t q = 0; q < p.count; ++q) points_.push_back({p.at(q), p.weight_at(q)});
      return;
    }
    const double at = 1.0 / std::sqrt(3.0);  // 2 x 2 points give the variance of a linear share
    const GroupFrame& f = parent_.basis_.frames[k];
    for (double s : {-at, at})
      for (double t : {-at, at}) points_.push_back({f.centre + s * f.half_u + t * f.half_v, 1.0});
  }

  // The share of the source that a point sees past the solids between.
  double share_from(const Vec3& x, const Vec3& normal, const PlanarPolygon& source, bool near,
                    double whole) {
    std::array<const ShadowCone*, kMostOutlines> across;
    std::size_t count = 0;
    std::uint32_t cuts = 0;
    for (std::uint32_t solid : between_) {
      ShadowCone& cone = cones_[count];
      const auto hides =
          ShadowCone::make(x, normal, parent_.solids_[solid], parent_.culling_.tolerance_m(), cone);
      if (hides == ShadowCone::Hides::nothing) continue;
      if (hides == ShadowCone::Hides::all) return 0.0;
      if (cone.count == 0) return share_past_polygons(x, normal, source);
      const ShadowTest test = test_shadow(cone, source);
      if (test.side == ShadowSide::inside) return 0.0;
      if (test.side == ShadowSide::outside) continue;
      across[count++] = &cone;
      cuts = test.cuts;
    }
    if (count == 0) return 1.0;
    const double share =
        shadow_.visible_share(source, {across.data(), count}, cuts, x, normal, near, whole);
    return share >= 0.0 ? share : share_past_polygons(x, normal, source);
  }

  // The same past the polygons that solids are made of, where these are too cornered.
  double share_past_polygons(const Vec3& x, const Vec3& normal, const PlanarPolygon& source) {
    std::vector<const Blocker*> polygons;
    for (std::uint32_t solid : between_)
      for (std::uint32_t member : parent_.solids_[solid].members)
        polygons.push_back(&parent_.blockers_[member]);
    const double whole = point_to_polygon(x, normal, source.vertices);
    double seen = 0.0;
    for (const Polygon& part : parts_(x, source.vertices, source.plane, polygons))
      seen += point_to_polygon(x, normal, part);
    return whole > 0.0 ? seen / whole : 0.0;
  }

  // What points of one group see of the other's outline: the mean share and its deviation.
  std::pair<double, double> share_seen(std::uint32_t receiver, const PlanarPolygon& source,
                                       double radius_m) {
    const Vec3 &normal = node(receiver).normal, &at = node(receiver).centre;
    const double reach = kFarForCentroids * std::max(radius_m, source.radius_m);
    const double horizon = normal.dot(at) + parent_.culling_.tolerance_m();
    const bool near = (source.centroid - at).squaredNorm() < reach * reach ||
                      std::any_of(source.vertices.begin(), source.vertices.end(),
                                  [&](const Vec3& v) { return normal.dot(v) <= horizon; });
    double seen = 0.0, all = 0.0, squares = 0.0;
    find_points(receiver);
    for (const WeightedPoint& x : points_) {
      if (source.plane.distance_m(x.at) <= 0.0) continue;
      const Vec3 r = source.centroid - x.at;
      const double r2 = r.squaredNorm();
      const double whole = near ? point_to_polygon(x.at, normal, source.vertices)
                                : normal.dot(r) * -source.plane.normal.dot(r) / (r2 * r2);
      if (whole <= 0.0) continue;
      const double share = share_from(x.at, normal, source, near, whole);
      seen += x.weight * whole * share;
      all += x.weight * whole;
      squares += x.weight * whole * share * share;
    }
    if (all <= 0.0) return {0.0, 0.0};
    const double share = std::clamp(seen / all, 0.0, 1.0);
    return {share, std::sqrt(std::max(0.0, squares / all - share * share))};
  }

  // By outlines of the shadows; nothing if there are too many, or no outlines. Elements need one
  // direction only: the smaller one looks.
  std::optional<Visible> outlined_share(Pair pair, std::size_t from) {
    between_.clear();
    for (std::size_t k = from; k < stack_.size(); ++k)
      between_.push_back(parent_.solid_of_piece_[stack_[k]]);
    std::sort(between_.begin(), between_.end());
    between_.erase(std::unique(between_.begin(), between_.end()), between_.end());
    if (between_.size() > kMostOutlines) return std::nullopt;
    const PlanarPolygon *a = outline_of(pair.a, outline_a_), *b = outline_of(pair.b, outline_b_);
    if (!a || !b) return std::nullopt;
    ++found.counts.outlined;
    if (node(pair.a).is_leaf() && node(pair.b).is_leaf()) {
      const bool a_looks = a->radius_m <= b->radius_m;
      const auto [share, spread] =
          a_looks ? share_seen(pair.a, *b, a->radius_m) : share_seen(pair.b, *a, b->radius_m);
      // One point cannot tell how the share varies; n x n points miss an edge by 1/n of that.
      const double alone = share > 0.0 && share < 1.0 ? kMissed : 0.5 * kMissed;
      const double deviation = order_ == 1 ? alone : spread / order_;
      return Visible{share, deviation, deviation, deviation};
    }
    const auto [share_a, spread_a] = share_seen(pair.a, *b, a->radius_m);
    const auto [share_b, spread_b] = share_seen(pair.b, *a, b->radius_m);
    const double share = 0.5 * (share_a + share_b), doubt = 0.5 * std::abs(share_a - share_b);
    return Visible{share, std::sqrt(share * (1.0 - share)), std::hypot(spread_a, doubt),
                   std::hypot(spread_b, doubt)};
  }

  Visible visible(Pair pair, std::size_t from, int rays) {
    const std::optional<Visible> outlined = outlined_share(pair, from);
    return outlined ? *outlined : visible_share(pair, rays);
  }

  void link_elements(Pair pair, std::size_t from) {
    const std::uint32_t i = parent_.tree_.order[node(pair.a).begin];
    const std::uint32_t j = parent_.tree_.order[node(pair.b).begin];
    if (const Link* link = known_link(pair)) {
      add(*link);
      return;
    }
    const double kernel_per_m2 =
        parent_.kernel_.exchange_area_m2(i, j) / (node(pair.a).area_m2 * node(pair.b).area_m2);
    Link link{pair.a, pair.b, static_cast<float>(kernel_per_m2)};
    if (stack_.size() > from && kernel_per_m2 > 0.0) {
      order_ = 1;
      while (order_ < 3 && !is_tolerable(pair, uncertain(kernel_per_m2, kMissed / order_)))
        ++order_;
      const Visible seen = visible(pair, from, options_.rays);
      link.kernel_per_m2 *= static_cast<float>(seen.share);
      link.deviation_per_m2 = static_cast<float>(seen.spread * kernel_per_m2);
      ++found.counts.sampled;
    }
    if (link.kernel_per_m2 > 0.0f) add(link);
  }

  // One found before that is good enough now, or null.
  const Link* known_link(Pair pair) const {
    const auto at =
        std::lower_bound(known_.begin(), known_.end(), pair, [](const Link& link, const Pair& p) {
          return std::tie(link.a, link.b) < std::tie(p.a, p.b);
        });
    if (at == known_.end() || at->a != pair.a || at->b != pair.b) return nullptr;
    const double deviation = static_cast<double>(at->deviation_per_m2);
    return deviation == 0.0 || is_tolerable(pair, uncertain(deviation, 1.0)) ? &*at : nullptr;
  }

  static KernelStatistics uncertain(double kernel_per_m2, double share) {
    const double deviation = share * kernel_per_m2;
    return {kernel_per_m2, deviation, deviation, deviation};
  }

  // What one side gets wrong, relative to the mean irradiance, times the root of its area share.
  double error(std::uint32_t receiver, std::uint32_t source, double spread_over_receiver,
               double spread) const {
    return node(source).area_m2 *
           (spread_over_receiver * light_.mean[source] + spread * light_.spread[source]) *
           std::sqrt(node(receiver).area_m2 / node(0).area_m2);
  }

  struct Errors {
    double of_a, of_b;
    double larger() const { return std::max(of_a, of_b); }
  };
  Errors errors(Pair pair, const KernelStatistics& left_out) const {
    return {error(pair.a, pair.b, left_out.spread_a, left_out.spread),
            error(pair.b, pair.a, left_out.spread_b, left_out.spread)};
  }

  bool is_tolerable(Pair pair, const KernelStatistics& left_out) const {
    return errors(pair, left_out).larger() <= options_.error_of_a_link;
  }

  // The kernel between two groups as a polynomial.
  struct Polynomial {
    int degree = 0;
    double damping = 1.0;
    KernelFit fit;
  };

  // The lowest degree that leaves out little enough, with what it does leave out in `kernel`.
  bool find_degree(Pair pair, KernelStatistics& kernel, Polynomial& found_degree) const {
    const GroupFrame &a = parent_.basis_.frames[pair.a], &b = parent_.basis_.frames[pair.b];
    if (!a.is_flat || !b.is_flat) return false;
    found_degree.fit = fit_kernel(a, node(pair.a).normal, b, node(pair.b).normal);
    const auto& of_degree = found_degree.fit.of_degree;
    for (int d = 1; d <= options_.most_degree; ++d) {
      kernel = of_degree[static_cast<std::size_t>(d)];
      if (!is_tolerable(pair, kernel)) continue;
      const double damping = found_degree.fit.damping(d), gone = 1.0 - damping;
      kernel.spread = std::hypot(kernel.spread, gone * of_degree[0].spread);
      kernel.spread_a = std::hypot(kernel.spread_a, gone * of_degree[0].spread_a);
      kernel.spread_b = std::hypot(kernel.spread_b, gone * of_degree[0].spread_b);
      if (!is_tolerable(pair, kernel)) continue;
      found_degree.degree = d;
      found_degree.damping = damping;
      return true;
    }
    return false;
  }

  bool link_groups(Pair pair, std::size_t from) {
    const ElementNode &a = node(pair.a), &b = node(pair.b);
    const bool is_near = gap_m(a, b) < kFarEnough * std::max(a.radius_m, b.radius_m);
    KernelStatistics kernel =
        kernel_statistics(parent_.samples_[pair.a], parent_.samples_[pair.b], b.centre - a.centre);
    // Too near for the points: the exchange is at most the smaller area, and may be all of it.
    if (is_near) {
      const double most = 1.0 / std::max(a.area_m2, b.area_m2);
      kernel.mean = std::min(kernel.mean, most);
      kernel.spread = kernel.spread_a = kernel.spread_b = 0.5 * most;
    }
    Polynomial polynomial;
    if (!is_tolerable(pair, kernel) && (is_near || !find_degree(pair, kernel, polynomial)))
      return false;
    if (kernel.mean == 0.0) return true;
    double share = 1.0;
    if (stack_.size() > from) {
      // No shadow's edge leaves less than this; most leave more, and then the work was for nothing.
      if (!is_tolerable(pair, with_shadow(kernel, {1.0, kLeastShadow, kLeastShadow, kLeastShadow})))
        return false;
      order_ = 2;
      const Visible seen = visible(pair, from, kGroupSamples);
      kernel = with_shadow(kernel, seen);
      if (!is_tolerable(pair, kernel)) return false;
      share = seen.share;
      ++found.counts.sampled;
    }
    count_error(pair, kernel);
    if (share > 0.0 && polynomial.degree == 0)
      add({pair.a, pair.b, static_cast<float>(share * kernel.mean)});
    else if (share > 0.0)
      add(pair, share, polynomial);
    return true;
  }

  static KernelStatistics with_shadow(const KernelStatistics& kernel, const Visible& visible) {
    return {kernel.mean, std::hypot(kernel.spread, visible.spread * kernel.mean),
            std::hypot(kernel.spread_a, visible.spread_a * kernel.mean),
            std::hypot(kernel.spread_b, visible.spread_b * kernel.mean)};
  }

  void add(const Link& link) {
    found.links.push_back(link);
    if (link.deviation_per_m2 > 0.0f)
      count_error({link.a, link.b}, uncertain(static_cast<double>(link.deviation_per_m2), 1.0));
  }

  void count_error(Pair pair, const KernelStatistics& left_out) {
    const Errors error = errors(pair, left_out);
    found.counts.sum_of_squares += error.of_a * error.of_a + error.of_b * error.of_b;
  }

  void add(Pair pair, double share, const Polynomial& polynomial) {
    const int n = terms_of(polynomial.degree);
    found.polynomial.push_back({pair.a, pair.b, static_cast<std::uint32_t>(polynomial.degree),
                                found.coefficients_per_m2.size()});
    const auto rest = static_cast<float>(share * polynomial.damping);
    for (int k = 0; k < n; ++k)
      for (int l = 0; l < n; ++l)
        found.coefficients_per_m2.push_back((k + l == 0 ? static_cast<float>(share) : rest) *
                                            polynomial.fit.coefficient_per_m2[k][l]);
  }

  const LinkRefinement& parent_;
  const NodeLight& light_;
  const LinkOptions& options_;
  std::span<const Link> known_;
  std::vector<std::uint32_t> stack_;
  std::deque<Pair>* queue_ = nullptr;
  VisibleParts parts_;
  ShadowParts shadow_;
  std::array<ShadowCone, kMostOutlines> cones_;
  std::optional<PlanarPolygon> outline_a_, outline_b_;
  std::vector<std::uint32_t> between_;  // solids
  std::vector<WeightedPoint> points_;
  PatchPointBuffer of_element_;
  int order_ = 3;  // of the Gauss points of elements
};

void Links::append(Links&& other) {
  links.insert(links.end(), other.links.begin(), other.links.end());
  for (PolynomialLink link : other.polynomial) {
    link.first += coefficients_per_m2.size();
    polynomial.push_back(link);
  }
  coefficients_per_m2.insert(coefficients_per_m2.end(), other.coefficients_per_m2.begin(),
                             other.coefficients_per_m2.end());
  counts.tried += other.counts.tried;
  counts.hidden += other.counts.hidden;
  counts.sampled += other.counts.sampled;
  counts.rays += other.counts.rays;
  counts.outlined += other.counts.outlined;
  counts.sum_of_squares += other.counts.sum_of_squares;
  other = {};
}

namespace {

constexpr double kOneSide = 2e-9;  // of the scene: what may reach behind an element's plane

double diameter_m(const PatchMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Piece& piece : mesh.pieces)
    for (const Vec3& v : piece.polygon) box.extend(v);
  return box.diagonal().norm();
}

}  // namespace

LinkRefinement::LinkRefinement(const PatchMesh& mesh, const Visibility& visibility,
                               const GroupBasis& basis, const ShaftCulling& culling,
                               double kernel_tolerance, std::uint64_t seed)
    : visibility_(visibility),
      basis_(basis),
      tree_(basis.tree),
      culling_(culling),
      samples_(group_samples(mesh, basis.tree, seed)),
      polygons_(planar_polygons(mesh)),
      kernel_(polygons_, basis.tree.order, kernel_tolerance, kOneSide * diameter_m(mesh)) {
  for (const Piece& piece : mesh.pieces) blockers_.push_back({piece.polygon, piece.plane});
  find_solids();
}

// Pieces that cannot block stay out: an opening would close a block's side.
void LinkRefinement::find_solids() {
  std::vector<Blocker> polygons;
  for (std::uint32_t piece : culling_.blockers()) polygons.push_back(blockers_[piece]);
  solids_ = convex_occluders(polygons, culling_.tolerance_m());
  solid_of_piece_.resize(blockers_.size());
  for (std::uint32_t k = 0; k < solids_.size(); ++k)
    for (std::uint32_t& member : solids_[k].members) {
      member = culling_.blockers()[member];
      solid_of_piece_[member] = k;
    }
}

Links LinkRefinement::refine(const NodeLight& light, const LinkOptions& options,
                             std::span<const Link> known) const {
  // Breadth first until there is work for all threads.
  std::deque<Pair> queue = {{0, 0}};
  Walk first(*this, light, options, known);
  while (!queue.empty() && queue.size() < kTasks) {
    const Pair pair = queue.front();
    queue.pop_front();
    first.step(pair, queue);
  }
  const std::vector<Pair> tasks(queue.begin(), queue.end());
  std::vector<Links> found(tasks.size() + 1);
  found.back() = std::move(first.found);
  std::atomic<std::size_t> done{0}, bytes{0};
  std::mutex progress_lock;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, tasks.size(), 4), [&](const auto& range) {
    for (std::size_t t = range.begin(); t < range.end() && bytes <= options.most_bytes; ++t) {
      Walk walk(*this, light, options, known);
      walk.run(tasks[t]);
      bytes += walk.found.bytes();
      found[t] = std::move(walk.found);
    }
    const std::size_t count = done += range.end() - range.begin();
    if (!options.progress) return;
    const std::lock_guard guard(progress_lock);
    options.progress("links", static_cast<double>(count) / static_cast<double>(tasks.size()));
  });
  if (bytes > options.most_bytes)
    throw std::length_error("more than " + std::to_string(options.most_bytes >> 20) +
                            " MiB of links");
  Links all;
  for (Links& part : found) all.append(std::move(part));
  return all;
}

}  // namespace truebox

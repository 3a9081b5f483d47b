// SPDX-License-Identifier: BSD-3-Clause
#include "transport/exact_pairs.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "transport/quadrature.h"

namespace truebox {
namespace {

constexpr double kAbsolute = 0.1;         // of a row that the tolerance is worth to a pair
constexpr double kFarForCentroids = 2.0;  // radii; nearer, Lambert of every part

std::vector<FlatSource> flat_sources(const std::vector<PlanarPolygon>& polygons) {
  std::vector<FlatSource> flat;
  flat.reserve(polygons.size());
  for (const PlanarPolygon& polygon : polygons) flat.emplace_back(polygon);
  return flat;
}

// Shares of the way from a to b where it enters a solid and leaves it, or would.
std::pair<double, double> passage(const Vec3& a, const Vec3& b, const ConvexOccluder& solid) {
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

bool above(const PlanarPolygon& polygon, const Plane& plane) {
  return std::all_of(polygon.vertices.begin(), polygon.vertices.end(),
                     [&](const Vec3& v) { return plane.distance_m(v) > 0.0; });
}

// Values of the highest polynomial that a rule sees at its points, times its weights.
using Polynomial = std::array<double, kFinestOutlineOrder>;

const Polynomial& highest_polynomial(int order) {
  static const auto all = [] {
    std::array<Polynomial, kFinestOutlineOrder + 1> found{};
    for (int n = 1; n <= kFinestOutlineOrder; ++n) {
      const GaussRule& rule = gauss_rule(n);
      for (int k = 0; k < n; ++k) {
        double p0 = 1.0, p1 = 2.0 * rule.nodes[k] - 1.0;
        const double x = p1;
        for (int d = 2; d < n; ++d)
          p0 = std::exchange(p1, ((2 * d - 1) * x * p1 - (d - 1) * p0) / d);
        found[n][k] = rule.weights[k] * p1;
      }
    }
    return found;
  }();
  return all[static_cast<std::size_t>(order)];
}

// The highest polynomials that a rule of order x order points sees in each direction, the largest
// row and column. Linear changes, which the rule integrates, have none from three points on.
double roughness(std::span<const double> values, int order) {
  const Polynomial& highest = highest_polynomial(order);
  const auto n = static_cast<std::size_t>(order);
  double most = 0.0;
  for (std::size_t j = 0; j < n; ++j) {
    double row = 0.0, column = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      row += highest[i] * values[j * n + i];
      column += highest[i] * values[i * n + j];
    }
    most = std::max({most, std::abs(row), std::abs(column)});
  }
  return most;
}

// Visible shares weighted with the kernel, quad by quad of the receiver.
class ShareSum {
 public:
  explicit ShareSum(int order) : order_(order), block_(static_cast<std::size_t>(order * order)) {}

  void add(double kernel, double share) {
    all_ += kernel;
    seen_ += kernel * share;
    shares_[count_++] = share;
    if (count_ < block_) return;
    count_ = 0;
    roughness_ = std::max(roughness_, roughness({shares_.data(), block_}, order_));
  }
  double mean() const { return all_ > 0.0 ? seen_ / all_ : 0.0; }
  double roughness_of_all() const { return roughness_; }

 private:
  int order_;
  std::size_t block_, count_ = 0;
  double all_ = 0.0, seen_ = 0.0, roughness_ = 0.0;
  std::array<double, kFinestOutlineOrder * kFinestOutlineOrder> shares_;
};

}  // namespace

ExactPairs::ExactPairs(const PatchMesh& mesh, const Scene& scene,
                       const ExactFormFactorOptions& options)
    : polygons_(planar_polygons(mesh)),
      flat_(flat_sources(polygons_)),
      tolerance_m_(1e-9 * scene.diameter_m()),
      planner_(mesh, scene, polygons_, tolerance_m_, options.occlusion),
      kernel_(polygons_, planner_.order(), options.relative_tolerance, 2.0 * tolerance_m_),
      adaptive_{.relative_tolerance = options.relative_tolerance},
      outline_points_(options.outline_points),
      outline_tolerance_(options.outline_tolerance) {}

PartialPair ExactPairs::oriented(std::uint32_t i, std::uint32_t j,
                                 std::span<const std::uint32_t> occluders) const {
  const PlanarPolygon &a = polygons_[i], &b = polygons_[j];
  double change_i = 0.0, change_j = 0.0;
  for (std::uint32_t id : occluders) {
    const auto [enter, leave] = passage(a.centroid, b.centroid, planner_.occluders()[id]);
    change_i = std::max(change_i, (1.0 - leave) / enter);
    change_j = std::max(change_j, enter / (1.0 - leave));
  }
  return change_i * a.radius_m * a.radius_m > change_j * b.radius_m * b.radius_m
             ? PartialPair{j, i, 0, 0}
             : PartialPair{i, j, 0, 0};
}

double ExactPairs::exchange_m2(const PartialPair& pair, std::span<const std::uint32_t> occluders,
                               ReceiverView& view) const {
  if (outline_points_ == 0) return adaptive_exchange_m2(pair, occluders);
  view.take_points(outline_points_);
  Share share = visible_share(pair, occluders, view);
  if (share.roughness == 0.0 && share.mean == 0.0) return 0.0;
  const double whole = kernel_.exchange_area_m2(pair.receiver, pair.source);
  const double least = std::min(polygons_[pair.receiver].area_m2, polygons_[pair.source].area_m2);
  double error = share.roughness;
  for (int order = 2 * outline_points_; order <= kFinestOutlineOrder; order *= 2) {
    if (whole * error <= outline_tolerance_ * least) break;
    view.take_points(order);
    const Share finer = visible_share(pair, occluders, view);
    error = std::abs(finer.mean - share.mean);
    share = finer;
  }
  return std::max(0.0, share.mean * whole);  // a share is found by differences, too
}

double ExactPairs::adaptive_exchange_m2(const PartialPair& pair,
                                        std::span<const std::uint32_t> occluders) const {
  const PlanarPolygon &receiver = polygons_[pair.receiver], &source = polygons_[pair.source];
  ExactVisibilityOptions options = adaptive_;
  options.absolute_tolerance_m2 =
      kAbsolute * options.relative_tolerance * std::min(receiver.area_m2, source.area_m2);
  std::vector<const ConvexOccluder*> solids;
  for (std::uint32_t id : occluders) solids.push_back(&planner_.occluders()[id]);
  if (const auto found = visible_exchange(receiver, source, solids, options))
    return found->exchange_area_m2;
  return visible_exchange(receiver, source, members_of(occluders), options).exchange_area_m2;
}

std::vector<const Blocker*> ExactPairs::members_of(std::span<const std::uint32_t> occluders) const {
  std::vector<const Blocker*> blockers;
  for (std::uint32_t id : occluders)
    for (std::uint32_t member : planner_.occluders()[id].members)
      blockers.push_back(&planner_.blockers()[member]);
  return blockers;
}

// Of the source, over the points of the view.
ExactPairs::Share ExactPairs::visible_share(const PartialPair& pair,
                                            std::span<const std::uint32_t> occluders,
                                            ReceiverView& view) const {
  const PlanarPolygon &receiver = polygons_[pair.receiver], &source = polygons_[pair.source];
  const double d2 = (receiver.centroid - source.centroid).squaredNorm();
  const double reach = kFarForCentroids * std::max(receiver.radius_m, source.radius_m);
  const bool near = d2 < reach * reach || !above(source, receiver.plane);
  Share share;
  if (!near && share_by_lanes(pair, occluders, view, share)) return share;
  return share_by_points(pair, occluders, near, view);
}

bool ExactPairs::share_by_lanes(const PartialPair& pair, std::span<const std::uint32_t> occluders,
                                ReceiverView& view, Share& share) const {
  constexpr std::size_t kMostShadows = 16;
  const PlanarPolygon &receiver = polygons_[pair.receiver], &source = polygons_[pair.source];
  if (!FlatSource::fits(source) || occluders.size() > kMostShadows) return false;
  const auto blocks = view.lane_points();
  std::array<std::span<const ReceiverView::Lanes>, kMostShadows> lanes;
  for (std::size_t k = 0; k < occluders.size(); ++k) lanes[k] = view.lane_shadows(occluders[k]);
  ShareSum sum(view.order());
  std::size_t left = view.points().count;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    std::array<const LaneShadow*, kMostShadows> shadows;
    for (std::size_t k = 0; k < occluders.size(); ++k) {
      if (!lanes[k][b].fits) return false;
      shadows[k] = &lanes[k][b].shadow;
    }
    LaneShares found;
    if (!hidden_shares(blocks[b], receiver.plane.normal, source, flat_[pair.source],
                       {shadows.data(), occluders.size()}, found))
      return false;
    const std::size_t count = std::min(kShadowLanes, left);
    for (std::size_t l = 0; l < count; ++l) sum.add(found.kernel_m2[l], 1.0 - found.hidden[l]);
    left -= count;
  }
  share = {sum.mean(), sum.roughness_of_all()};
  return true;
}

ExactPairs::Share ExactPairs::share_by_points(const PartialPair& pair,
                                              std::span<const std::uint32_t> occluders, bool near,
                                              ReceiverView& view) const {
  const PlanarPolygon &receiver = polygons_[pair.receiver], &source = polygons_[pair.source];
  ShareSum sum(view.order());
  for (std::uint32_t k = 0; k < view.points().count; ++k) {
    const Vec3 x = view.points().at(k), r = source.centroid - x;
    const double r2 = r.squaredNorm();
    const double factor =
        near ? point_to_polygon(x, receiver.plane.normal, source.vertices)
             : receiver.plane.normal.dot(r) * -source.plane.normal.dot(r) / (r2 * r2);
    sum.add(view.points().weight_at(k) * factor,
            share_from(k, factor, near, pair, occluders, view));
  }
  return {sum.mean(), sum.roughness_of_all()};
}

// Of the source, seen from one point.
double ExactPairs::share_from(std::uint32_t k, double factor, bool near, const PartialPair& pair,
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
    const ShadowTest test = test_shadow(shadow.cone, polygons_[pair.source]);
    if (test.side == ShadowSide::inside) return 0.0;
    if (test.side == ShadowSide::outside) continue;
    across[count++] = &shadow.cone;
    cuts = test.cuts;
  }
  if (fits && count == 0) return 1.0;
  const PlanarPolygon &receiver = polygons_[pair.receiver], &source = polygons_[pair.source];
  const Vec3 x = view.points().at(k);
  if (fits) {
    const double share = view.parts.visible_share(source, {across.data(), count}, cuts, x,
                                                  receiver.plane.normal, near, factor);
    if (share >= 0.0) return share;
  }
  double seen = 0.0;
  for (const Polygon& part :
       view.any_parts(x, source.vertices, source.plane, members_of(occluders)))
    seen += point_to_polygon(x, receiver.plane.normal, part);
  const double all = point_to_polygon(x, receiver.plane.normal, source.vertices);
  return all > 0.0 ? seen / all : 0.0;
}

}  // namespace truebox

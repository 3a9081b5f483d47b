// SPDX-License-Identifier: BSD-3-Clause
#include "transport/exact_visibility.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "transport/nusselt.h"
#include "transport/polygon_rule.h"
#include "transport/shadow_cones.h"
#include "transport/split_by_shadows.h"
#include "transport/view_events.h"

namespace truebox {
namespace {

constexpr std::size_t kMostCells = 20'000;  // of the first cut; bisection goes on from there
constexpr double kMostlyVisible = 0.1;      // share from which the hidden part is integrated
constexpr double kRounding = 100.0 * std::numeric_limits<double>::epsilon();  // of the whole pair
constexpr double kTermRounding = 20.0 * std::numeric_limits<double>::epsilon();  // of Lambert's sum
constexpr double kCutsAddTerms = 4.0;  // edges of shadows, which a visible part sums as well

// A bilinear quad of the receiver (a triangle repeats a corner) and what was found on it.
struct Cell {
  std::array<Vec3, 4> corners;
  double area_m2 = 0.0;
  double value = 0.0, error = 0.0;
  bool finest_rule = false;
  bool rougher_in_u = true;
};

// P3 and P4, the parts of an integrand on [-1, 1] that a 5 point rule sees last.
double roughness(const std::array<double, 5>& f) {
  const GaussRule& rule = gauss_rule(5);
  double p3 = 0.0, p4 = 0.0;
  for (int i = 0; i < 5; ++i) {
    const double x = 2.0 * rule.nodes[i] - 1.0, x2 = x * x;
    p3 += rule.weights[i] * f[i] * 0.5 * (5.0 * x2 - 3.0) * x;
    p4 += rule.weights[i] * f[i] * 0.125 * ((35.0 * x2 - 30.0) * x2 + 3.0);
  }
  return std::abs(p3) + std::abs(p4);
}

// Behind polygons: visible and hidden parts of the source, and the cells between visual events.
class BehindPolygons {
 public:
  BehindPolygons(const PlanarPolygon& receiver, const PlanarPolygon& source,
                 std::span<const Blocker* const> blockers, int nusselt_arcs)
      : receiver_(receiver), source_(source), blockers_(blockers), arcs_(nusselt_arcs) {}

  std::vector<Polygon> cells() const {
    return cells_between_events(receiver_, source_, blockers_, kMostCells);
  }
  bool may_cross() const { return blockers_.size() > 1 && arcs_ == 0; }  // chords err by more
  double visible(const Vec3& point) { return factor_sum(point, split(point)); }
  double hidden(const Vec3& point) {
    split(point);
    return factor_sum(point, parts_.hidden());
  }

 private:
  std::span<const Polygon> split(const Vec3& point) {
    return parts_(point, source_.vertices, source_.plane, blockers_);
  }
  double factor_sum(const Vec3& point, std::span<const Polygon> parts) const {
    double sum = 0.0;
    const Vec3& normal = receiver_.plane.normal;
    for (const Polygon& part : parts)
      sum += arcs_ > 0 ? nusselt_factor(point, normal, part, arcs_)
                       : point_to_polygon(point, normal, part);
    return sum;
  }

  const PlanarPolygon& receiver_;
  const PlanarPolygon& source_;
  std::span<const Blocker* const> blockers_;
  int arcs_;
  SplitByShadows parts_;
};

// The same behind convex solids.
class BehindSolids {
 public:
  BehindSolids(const PlanarPolygon& receiver, const PlanarPolygon& source,
               std::span<const ConvexOccluder* const> solids)
      : receiver_(receiver),
        source_(source),
        solids_(solids),
        cones_(solids.size()),
        tolerance_m_(1e-13 * (receiver.centroid - source.centroid).norm()) {}

  std::vector<Polygon> cells() const {
    return cells_between_events(receiver_, source_, solids_, kMostCells);
  }
  bool may_cross() const { return solids_.size() > 1; }
  double visible(const Vec3& point) {
    switch (look(point)) {
      case ShadowSide::outside: return whole(point);
      case ShadowSide::inside: return 0.0;
      default: return parts_.visible_factor(point, receiver_.plane.normal);
    }
  }
  double hidden(const Vec3& point) {
    switch (look(point)) {
      case ShadowSide::outside: return 0.0;
      case ShadowSide::inside: return whole(point);
      default: return parts_.hidden_factor(point, receiver_.plane.normal);
    }
  }
  // Too many parts or planes somewhere: what was found is nothing worth.
  bool failed() const { return failed_; }

 private:
  double whole(const Vec3& point) const {
    return point_to_polygon(point, receiver_.plane.normal, source_.vertices);
  }

  // `across`: the parts are cut.
  ShadowSide look(const Vec3& point) {
    active_.clear();
    for (std::size_t k = 0; k < solids_.size(); ++k) {
      const auto hides =
          ShadowCone::make(point, receiver_.plane.normal, *solids_[k], tolerance_m_, cones_[k]);
      if (hides == ShadowCone::Hides::nothing) continue;
      if (hides == ShadowCone::Hides::all) return ShadowSide::inside;
      failed_ = failed_ || cones_[k].count == 0;
      const ShadowSide side = test_shadow(cones_[k], source_).side;
      if (side == ShadowSide::inside) return side;
      if (side == ShadowSide::across) active_.push_back(&cones_[k]);
    }
    if (active_.empty()) return ShadowSide::outside;
    failed_ = failed_ || !parts_.cut(source_.vertices, active_);
    return ShadowSide::across;
  }

  const PlanarPolygon& receiver_;
  const PlanarPolygon& source_;
  std::span<const ConvexOccluder* const> solids_;
  std::vector<ShadowCone> cones_;
  std::vector<const ShadowCone*> active_;
  ShadowParts parts_;
  double tolerance_m_;
  bool failed_ = false;
};

template <class Shadows>
class Integrator {
 public:
  Integrator(const PlanarPolygon& receiver, const PlanarPolygon& source, Shadows shadows,
             const ExactVisibilityOptions& options)
      : receiver_(receiver), source_(source), shadows_(std::move(shadows)), options_(options) {}

  const Shadows& shadows() const { return shadows_; }

  VisibleExchange run() {
    for (const Polygon& cell : shadows_.cells()) add_cells(cell);
    double visible = 0.0, hidden = 0.0;
    for (const Cell& cell : cells_) {
      const auto& q = cell.corners;
      const Vec3 middle = q[3] == q[0] ? Vec3((q[0] + q[1] + q[2]) / 3.0)
                                       : Vec3(0.25 * (q[0] + q[1] + q[2] + q[3]));
      visible += cell.area_m2 * factor_at(middle, true);
      hidden += cell.area_m2 * factor_at(middle, false);
    }
    const double all = visible + hidden;
    VisibleExchange result;
    integrate_visible_ = options_.nusselt_arcs > 0 || visible < kMostlyVisible * all;
    BoundedExchange whole;
    if (!integrate_visible_) whole = bounded_exchange(receiver_, source_, 1e-13);
    const double rounding = kRounding * all + rounding_of_terms_m2();
    refine(whole.exchange_area_m2, rounding + whole.error_bound_m2);
    result.exchange_area_m2 =
        integrate_visible_ ? value_ : std::max(0.0, whole.exchange_area_m2 - value_);
    result.error_bound_m2 = error_ + whole.error_bound_m2 + rounding;
    result.evaluations = evaluations_;
    result.converged =
        result.error_bound_m2 <= options_.relative_tolerance * result.exchange_area_m2 ||
        result.error_bound_m2 <= options_.absolute_tolerance_m2 ||
        result.error_bound_m2 <= 2.0 * (rounding + whole.error_bound_m2);
    return result;
  }

 private:
  double factor_at(const Vec3& point, bool visible) {
    ++evaluations_;
    return visible ? shadows_.visible(point) : shadows_.hidden(point);
  }

  // Where the planes are nearly one, terms of order 1 sum up to little.
  double rounding_of_terms_m2() const {
    const Vec3& normal = receiver_.plane.normal;
    double most = lambert_terms(receiver_.centroid, normal, source_.vertices);
    for (const Vec3& corner : receiver_.vertices)
      most = std::max(most, lambert_terms(corner, normal, source_.vertices));
    return kTermRounding * kCutsAddTerms * receiver_.area_m2 * most;
  }

  void add_cells(const Polygon& p) {
    for (std::size_t k = 1; k + 1 < p.size(); k += 2) {
      const bool quad = k + 2 < p.size();
      Cell cell;
      cell.corners = {p[0], p[k], p[k + 1], quad ? p[k + 2] : p[0]};
      cell.area_m2 = area_vector(cell.corners).norm();
      if (cell.area_m2 > 1e-18 * receiver_.area_m2) cells_.push_back(cell);
    }
  }

  template <int kPoints>
  double gauss(const Cell& cell, std::array<std::array<double, kPoints>, kPoints>& values) {
    const GaussRule& rule = gauss_rule(kPoints);
    double sum = 0.0;
    for_each_gauss_point_of_quad(cell.corners, receiver_.plane.normal, kPoints,
                                 [&](int i, int j, const Vec3& x, double area) {
                                   values[i][j] = area * factor_at(x, integrate_visible_);
                                   sum += rule.weights[i] * rule.weights[j] * values[i][j];
                                 });
    return sum;
  }

  void apply_rough_rules(Cell& cell) {
    std::array<std::array<double, 2>, 2> two;
    std::array<std::array<double, 3>, 3> three;
    const double rough = gauss<2>(cell, two);
    cell.value = gauss<3>(cell, three);
    cell.error = std::abs(cell.value - rough);
    look_at_corners(cell);
  }

  // Where shadows of two blockers meet, along curves that no cut follows, a lit corner (or a dark
  // one) may lie between the points of a rule: a cell whose points all see nothing may be off by
  // what its corners see.
  void look_at_corners(Cell& cell) {
    if (cell.value != 0.0 || cell.error != 0.0 || !shadows_.may_cross()) return;
    constexpr double kInset = 0.01;  // corners themselves belong to the neighbours, too
    const auto& q = cell.corners;
    const Vec3 middle = 0.25 * (q[0] + q[1] + q[2] + q[3]);
    double most = 0.0;
    for (const Vec3& corner : q)
      most = std::max(most, factor_at(corner + kInset * (middle - corner), integrate_visible_));
    cell.error = cell.area_m2 * most;
  }

  void apply_fine_rule(Cell& cell) {
    std::array<std::array<double, 5>, 5> five;
    const double fine = gauss<5>(cell, five);
    cell.error = std::abs(fine - cell.value);
    cell.value = fine;
    cell.finest_rule = true;
    double in_u = 0.0, in_v = 0.0;
    const GaussRule& rule = gauss_rule(5);
    for (int k = 0; k < 5; ++k) {
      std::array<double, 5> row, column;
      for (int l = 0; l < 5; ++l) {
        row[l] = five[l][k];
        column[l] = five[k][l];
      }
      in_u += rule.weights[k] * roughness(row);
      in_v += rule.weights[k] * roughness(column);
    }
    cell.rougher_in_u = in_u > in_v;
    if (in_u == 0.0 && in_v == 0.0) {
      const auto& q = cell.corners;
      cell.rougher_in_u =
          (q[1] + q[2] - q[0] - q[3]).squaredNorm() > (q[2] + q[3] - q[0] - q[1]).squaredNorm();
      look_at_corners(cell);
    }
  }

  // Worst cell first: a finer rule, then halves.
  void refine(double whole, double rounding) {
    const auto less = [](const Cell& a, const Cell& b) { return a.error < b.error; };
    for (Cell& cell : cells_) {
      apply_rough_rules(cell);
      value_ += cell.value;
      error_ += cell.error;
    }
    std::make_heap(cells_.begin(), cells_.end(), less);
    const auto target = [&] {
      const double result = integrate_visible_ ? value_ : whole - value_;
      return std::max({0.9 * options_.relative_tolerance * result - rounding,
                       options_.absolute_tolerance_m2 - rounding, 0.5 * rounding});
    };
    while (!cells_.empty() && error_ > target() && evaluations_ < options_.most_evaluations) {
      std::pop_heap(cells_.begin(), cells_.end(), less);
      Cell cell = cells_.back();
      cells_.pop_back();
      if (cell.error == 0.0) break;
      value_ -= cell.value;
      error_ -= cell.error;
      if (!cell.finest_rule) {
        apply_fine_rule(cell);
        push(cell, less);
        continue;
      }
      for (Cell half : halves(cell)) {
        apply_rough_rules(half);
        apply_fine_rule(half);
        push(half, less);
      }
    }
    value_ = error_ = 0.0;  // the running sums carry the rounding of all that was taken away
    for (const Cell& cell : cells_) {
      value_ += cell.value;
      error_ += cell.error;
    }
  }

  template <class Less>
  void push(const Cell& cell, const Less& less) {
    value_ += cell.value;
    error_ += cell.error;
    cells_.push_back(cell);
    std::push_heap(cells_.begin(), cells_.end(), less);
  }

  static std::array<Cell, 2> halves(const Cell& cell) {
    const auto& q = cell.corners;
    std::array<Cell, 2> parts;
    if (cell.rougher_in_u) {
      const Vec3 low = 0.5 * (q[0] + q[1]), high = 0.5 * (q[3] + q[2]);
      parts[0].corners = {q[0], low, high, q[3]};
      parts[1].corners = {low, q[1], q[2], high};
    } else {
      const Vec3 left = 0.5 * (q[0] + q[3]), right = 0.5 * (q[1] + q[2]);
      parts[0].corners = {q[0], q[1], right, left};
      parts[1].corners = {left, right, q[2], q[3]};
    }
    return parts;
  }

  const PlanarPolygon& receiver_;
  const PlanarPolygon& source_;
  Shadows shadows_;
  const ExactVisibilityOptions& options_;
  std::vector<Cell> cells_;
  bool integrate_visible_ = true;
  double value_ = 0.0, error_ = 0.0;
  std::size_t evaluations_ = 0;
};

}  // namespace

VisibleExchange visible_exchange(const PlanarPolygon& i, const PlanarPolygon& j,
                                 std::span<const Blocker* const> blockers,
                                 const ExactVisibilityOptions& options) {
  Polygon part_i, part_j;
  if (!facing_parts(i, j, part_i, part_j)) return {0.0, 0.0, 0, true};
  const PlanarPolygon a(std::move(part_i)), b(std::move(part_j));
  const bool b_receives = b.radius_m < a.radius_m;
  const PlanarPolygon &receiver = b_receives ? b : a, &source = b_receives ? a : b;
  return Integrator(receiver, source,
                    BehindPolygons(receiver, source, blockers, options.nusselt_arcs), options)
      .run();
}

std::optional<VisibleExchange> visible_exchange(const PlanarPolygon& receiver,
                                                const PlanarPolygon& source,
                                                std::span<const ConvexOccluder* const> solids,
                                                const ExactVisibilityOptions& options) {
  Polygon part_i, part_j;
  if (!facing_parts(receiver, source, part_i, part_j)) return VisibleExchange{0.0, 0.0, 0, true};
  const PlanarPolygon a(std::move(part_i)), b(std::move(part_j));
  Integrator work(a, b, BehindSolids(a, b, solids), options);
  const VisibleExchange result = work.run();
  if (work.shadows().failed()) return std::nullopt;
  return result;
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "transport/view_factors.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "transport/exact_visibility.h"
#include "transport/hemicube.h"
#include "transport/ray_casting.h"
#include "transport/shaft.h"

namespace truebox {
namespace {

constexpr std::pair<ViewFactorMethod, std::string_view> kNames[] = {
    {ViewFactorMethod::planned, "planned"},
    {ViewFactorMethod::analytic, "analytic"},
    {ViewFactorMethod::exact_visibility, "exact-visibility"},
    {ViewFactorMethod::ray_casting, "ray-casting"},
    {ViewFactorMethod::nusselt, "nusselt"},
    {ViewFactorMethod::hemicube, "hemicube"},
    {ViewFactorMethod::hidden, "hidden"}};

constexpr double kKernelTolerance = 1e-13;

// Rays reach a relative error of about 1/sqrt(n), one ray a blocker test each; exact visibility
// clips at some hundred points a cell, and its cells grow with the blockers.
bool rays_are_cheaper(const ViewFactorOptions& options, std::size_t blockers) {
  const double rays = 9.0 / (options.relative_tolerance * options.relative_tolerance);
  const double points = 400.0 * static_cast<double>(blockers);
  return rays < points;
}

ViewFactorEstimate from_analytic(const PlanarPolygon& i, const PlanarPolygon& j, bool blocked,
                                 const ViewFactorOptions& options) {
  const auto whole = bounded_exchange(i, j, kKernelTolerance);
  ViewFactorEstimate result;
  result.method = ViewFactorMethod::analytic;
  result.exchange_area_m2 = whole.exchange_area_m2;
  result.error_bound_m2 =
      blocked ? std::max(whole.exchange_area_m2, whole.error_bound_m2) : whole.error_bound_m2;
  result.evaluations = 1;
  result.converged = whole.exchange_area_m2 == 0.0 ||
                     result.error_bound_m2 <= options.relative_tolerance * whole.exchange_area_m2;
  return result;
}

// Behind solids where that is possible: several times as fast, and blocks have no inner edges.
VisibleExchange exchange_behind(const PlanarPolygon& i, const PlanarPolygon& j,
                                std::span<const ConvexOccluder* const> solids,
                                std::span<const Blocker* const> faces,
                                const ExactVisibilityOptions& options) {
  const bool j_receives = j.radius_m < i.radius_m;
  if (const auto seen =
          visible_exchange(j_receives ? j : i, j_receives ? i : j, solids, options))
    return *seen;
  return visible_exchange(i, j, faces, options);
}

ViewFactorEstimate from_exact_visibility(const PlanarPolygon& i, const PlanarPolygon& j,
                                         std::span<const ConvexOccluder* const> solids,
                                         std::span<const Blocker* const> faces,
                                         const ViewFactorOptions& options) {
  const auto seen = exchange_behind(i, j, solids, faces,
                                    {options.relative_tolerance, options.most_evaluations});
  ViewFactorEstimate result;
  result.method = ViewFactorMethod::exact_visibility;
  result.exchange_area_m2 = seen.exchange_area_m2;
  result.error_bound_m2 = seen.error_bound_m2;
  result.evaluations = seen.evaluations;
  result.converged = seen.converged;
  return result;
}

ViewFactorEstimate from_rays(const PlanarPolygon& i, const PlanarPolygon& j,
                             std::span<const Blocker* const> blockers,
                             const ViewFactorOptions& options, std::uint64_t seed, int rays) {
  const auto whole = bounded_exchange(i, j, kKernelTolerance);
  ViewFactorEstimate result;
  result.method = ViewFactorMethod::ray_casting;
  if (whole.exchange_area_m2 == 0.0) return result;
  const VisibleShare share = visible_share(i, j, blockers, rays, options.seed ^ seed);
  result.exchange_area_m2 = share.share * whole.exchange_area_m2;
  result.standard_error_m2 = share.standard_error * whole.exchange_area_m2;
  result.error_bound_m2 = 3.0 * result.standard_error_m2 + whole.error_bound_m2;
  result.evaluations = static_cast<std::size_t>(rays);
  result.converged = result.error_bound_m2 <= options.relative_tolerance * result.exchange_area_m2;
  return result;
}

// The chords' error falls like 1 / arcs^2: what the second run changes is three times what is left.
ViewFactorEstimate from_nusselt(const PlanarPolygon& i, const PlanarPolygon& j,
                                std::span<const Blocker* const> blockers,
                                const ViewFactorOptions& options) {
  constexpr double kLeastTolerance = 1e-5;  // below, the chords decide anyway
  ExactVisibilityOptions adaptive{std::max(options.relative_tolerance, kLeastTolerance),
                                  options.most_evaluations, std::max(1, options.arcs / 2)};
  const auto rough = visible_exchange(i, j, blockers, adaptive);
  adaptive.nusselt_arcs = options.arcs;
  const auto fine = visible_exchange(i, j, blockers, adaptive);
  ViewFactorEstimate result;
  result.method = ViewFactorMethod::nusselt;
  result.exchange_area_m2 = fine.exchange_area_m2;
  result.error_bound_m2 = fine.error_bound_m2 + rough.error_bound_m2 +
                          std::abs(fine.exchange_area_m2 - rough.exchange_area_m2);
  result.evaluations = fine.evaluations + rough.evaluations;
  result.converged = result.error_bound_m2 <= options.relative_tolerance * result.exchange_area_m2;
  return result;
}

ViewFactorEstimate from_hemicube(const PlanarPolygon& i, const PlanarPolygon& j,
                                 std::span<const Blocker* const> blockers,
                                 const ViewFactorOptions& options) {
  const auto seen = hemicube_exchange(i, j, blockers, options.resolution / 2 * 2);
  ViewFactorEstimate result;
  result.method = ViewFactorMethod::hemicube;
  result.exchange_area_m2 = seen.exchange_area_m2;
  result.error_bound_m2 = seen.error_bound_m2;
  result.aliasing_bound_m2 = seen.aliasing_bound_m2;
  result.evaluations = seen.pixels;
  result.converged = result.error_bound_m2 <= options.relative_tolerance * result.exchange_area_m2;
  return result;
}

}  // namespace

std::string_view name_of(ViewFactorMethod method) {
  for (const auto& [value, name] : kNames)
    if (value == method) return name;
  return {};
}

std::optional<ViewFactorMethod> view_factor_method(std::string_view name) {
  for (ViewFactorMethod method : kViewFactorMethods)
    if (name_of(method) == name) return method;
  return std::nullopt;
}

ViewFactors::ViewFactors(const Scene& scene) {
  Eigen::AlignedBox3d box;
  for (const Surface& surface : scene.surfaces)
    for (const Polygon& piece : surface.pieces)
      for (const Vec3& v : piece) box.extend(v);
  const Vec3 centre = box.isEmpty() ? Vec3(Vec3::Zero()) : Vec3(box.center());
  tolerance_m_ = 1e-12 * scene.diameter_m() +
                 4.0 * std::numeric_limits<double>::epsilon() * centre.cwiseAbs().maxCoeff();
  for (const Surface& surface : scene.surfaces) {
    pieces_of_.emplace_back();
    area_m2_.push_back(0.0);
    for (Polygon polygon : surface.pieces) {
      for (Vec3& v : polygon) v -= centre;
      Piece piece{PlanarPolygon(std::move(polygon)), {}, {}, surface.is_opening};
      for (const Vec3& v : piece.polygon.vertices) piece.box.extend(v);
      piece.blocker = {piece.polygon.vertices, piece.polygon.plane};
      area_m2_.back() += piece.polygon.area_m2;
      pieces_of_.back().push_back(static_cast<std::uint32_t>(pieces_.size()));
      pieces_.push_back(std::move(piece));
    }
  }
  find_solids();
}

constexpr std::uint32_t kNone = 0xffffffffu;

void ViewFactors::find_solids() {
  std::vector<Blocker> blockers;
  std::vector<std::uint32_t> piece_of;
  for (std::uint32_t p = 0; p < pieces_.size(); ++p) {
    if (pieces_[p].is_opening) continue;
    blockers.push_back(pieces_[p].blocker);
    piece_of.push_back(p);
  }
  solids_ = convex_occluders(blockers, tolerance_m_);
  solid_of_piece_.assign(pieces_.size(), kNone);
  for (std::uint32_t s = 0; s < solids_.size(); ++s)
    for (std::uint32_t& member : solids_[s].members) {
      member = piece_of[member];
      solid_of_piece_[member] = s;
    }
}

// False if one blocker hides everything.
bool ViewFactors::find_between(std::uint32_t p, std::uint32_t q, Between& between) const {
  const Eigen::AlignedBox3d hull = pieces_[p].box.merged(pieces_[q].box);
  const PlanarPolygon &i = pieces_[p].polygon, &j = pieces_[q].polygon;
  for (std::uint32_t s = 0; s < solids_.size(); ++s) {
    const ConvexOccluder& solid = solids_[s];
    // A face of a convex solid looks away from it.
    if (s == solid_of_piece_[p] || s == solid_of_piece_[q] || !hull.intersects(solid.box)) continue;
    const auto verdict =
        shaft_occlusion(i.vertices, i.plane, j.vertices, j.plane, solid, tolerance_m_);
    if (verdict == ShaftOcclusion::full) return false;
    if (verdict == ShaftOcclusion::none) continue;
    const std::size_t before = between.faces.size();
    for (std::uint32_t member : solid.members) {
      const Blocker& face = pieces_[member].blocker;
      const auto of_face =
          shaft_occlusion(i.vertices, i.plane, j.vertices, j.plane, face, tolerance_m_);
      if (of_face == ShaftOcclusion::full) return false;
      if (of_face == ShaftOcclusion::partial) between.faces.push_back(&face);
    }
    if (between.faces.size() > before) between.solids.push_back(&solid);
  }
  return true;
}

ViewFactorEstimate ViewFactors::between_pieces(std::uint32_t p, std::uint32_t q,
                                               const ViewFactorOptions& options) const {
  if (q < p) std::swap(p, q);
  const PlanarPolygon &i = pieces_[p].polygon, &j = pieces_[q].polygon;
  ViewFactorEstimate hidden;
  hidden.method = ViewFactorMethod::hidden;
  Between between;
  const bool visible = find_between(p, q, between);
  const auto& [solids, blockers] = between;
  switch (options.method) {
    case ViewFactorMethod::analytic:
      return from_analytic(i, j, !visible || !blockers.empty(), options);
    case ViewFactorMethod::exact_visibility:
      return visible ? from_exact_visibility(i, j, solids, blockers, options) : hidden;
    case ViewFactorMethod::ray_casting:
      return visible
                 ? from_rays(i, j, blockers, options, (std::uint64_t{p} << 32) | q, options.rays)
                 : hidden;
    case ViewFactorMethod::nusselt: return visible ? from_nusselt(i, j, blockers, options) : hidden;
    case ViewFactorMethod::hemicube:
      return visible ? from_hemicube(i, j, blockers, options) : hidden;
    case ViewFactorMethod::hidden:
    case ViewFactorMethod::planned: break;
  }
  if (!visible) return hidden;
  if (blockers.empty()) return from_analytic(i, j, false, options);
  if (!rays_are_cheaper(options, solids.size()))
    return from_exact_visibility(i, j, solids, blockers, options);
  const double tolerance = options.relative_tolerance;
  return from_rays(i, j, blockers, options, (std::uint64_t{p} << 32) | q,
                   static_cast<int>(9.0 / (tolerance * tolerance)));
}

ViewFactorEstimate ViewFactors::between(std::size_t i, std::size_t j,
                                        const ViewFactorOptions& options) const {
  ViewFactorEstimate sum;
  sum.method =
      options.method == ViewFactorMethod::planned ? ViewFactorMethod::hidden : options.method;
  double variance = 0.0, bias = 0.0;
  // The order of sums must not depend on which surface is named first.
  const auto& first = pieces_of_[std::min(i, j)];
  const auto& second = pieces_of_[std::max(i, j)];
  const auto cost = [](ViewFactorMethod m) { return m == ViewFactorMethod::hidden ? -1 : int(m); };
  for (std::uint32_t p : first)
    for (std::uint32_t q : second) {
      if (p == q) continue;
      const ViewFactorEstimate part = between_pieces(p, q, options);
      sum.exchange_area_m2 += part.exchange_area_m2;
      variance += part.standard_error_m2 * part.standard_error_m2;
      sum.aliasing_bound_m2 += part.aliasing_bound_m2;
      bias += part.error_bound_m2 - 3.0 * part.standard_error_m2;
      sum.evaluations += part.evaluations;
      sum.converged &= part.converged;
      if (options.method == ViewFactorMethod::planned && cost(part.method) > cost(sum.method))
        sum.method = part.method;  // the most laborious one names the sum
    }
  sum.standard_error_m2 = std::sqrt(variance);
  sum.error_bound_m2 = bias + 3.0 * sum.standard_error_m2;
  return sum;
}

PointView view_from_centre(const Scene& scene, std::size_t from, std::size_t to) {
  PointView view;
  double largest = 0.0;
  for (const Polygon& piece : scene.surfaces[from].pieces) {
    const PlanarPolygon polygon(piece);
    if (polygon.area_m2 <= largest) continue;
    largest = polygon.area_m2;
    view.point = polygon.centroid;
    view.normal = polygon.plane.normal;
  }
  std::vector<Blocker> blockers;
  for (const Surface& surface : scene.surfaces)
    for (const Polygon& piece : surface.pieces)
      if (!surface.is_opening) blockers.push_back({piece, plane_of(piece)});
  std::vector<const Blocker*> all;
  for (const Blocker& blocker : blockers) all.push_back(&blocker);
  const Plane horizon{view.normal, view.normal.dot(view.point)};
  VisibleParts parts;
  Polygon above;
  for (const Polygon& piece : scene.surfaces[to].pieces) {
    const Plane plane = plane_of(piece);
    if (plane.distance_m(view.point) <= 0.0) continue;
    clip(piece, horizon, 1e-13 * (piece[0] - view.point).norm(), above);
    if (above.empty()) continue;
    for (const Polygon& part : parts(view.point, above, plane, all)) {
      view.visible.push_back(part);
      view.factor += point_to_polygon(view.point, view.normal, part);
    }
  }
  return view;
}

}  // namespace truebox

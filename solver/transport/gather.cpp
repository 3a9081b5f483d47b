// SPDX-License-Identifier: BSD-3-Clause
#include "transport/gather.h"

#include <algorithm>

#include "transport/form_factor.h"
#include "transport/polygon_rule.h"

namespace truebox {
namespace {

constexpr std::uint32_t kNone = 0xffffffffu;

bool any_beyond(std::span<const Vec3> polygon, const Plane& plane, double sign,
                double tolerance_m) {
  return std::any_of(polygon.begin(), polygon.end(),
                     [&](const Vec3& v) { return sign * plane.distance_m(v) > tolerance_m; });
}

Eigen::Map<const Eigen::VectorXd> as_vector(const std::vector<double>& values) {
  return {values.data(), static_cast<Eigen::Index>(values.size())};
}

constexpr int kRulePoints = 4;              // a side
constexpr double kShadowTolerance = 1e-12;  // of the distance, as VisibleParts takes

}  // namespace

Gather::Gather(const PatchMesh& mesh, const Scene& scene, bool occlusion)
    : mesh_(mesh), scene_(scene), tolerance_m_(1e-9 * scene.diameter_m()) {
  blocker_of_.assign(mesh.pieces.size(), kNone);
  for (std::uint32_t p = 0; p < mesh.pieces.size(); ++p) {
    const Surface& surface = scene.surfaces[mesh.pieces[p].surface];
    if (surface.is_opening) continue;
    if (scene.material_of(surface).emits()) luminous_pieces_.push_back(p);
    // A piece with the whole scene on one side cannot stand between two points of it.
    bool front = false, behind = false;
    for (std::size_t q = 0; q < mesh.pieces.size() && !(front && behind); ++q) {
      const Polygon& other = mesh.pieces[q].polygon;
      front = front || any_beyond(other, mesh.pieces[p].plane, 1.0, tolerance_m_);
      behind = behind || any_beyond(other, mesh.pieces[p].plane, -1.0, tolerance_m_);
    }
    if (!occlusion || !front || !behind) continue;
    blockers_.push_back({mesh.pieces[p].polygon, mesh.pieces[p].plane});
    blocker_of_[p] = static_cast<std::uint32_t>(blocker_piece_.size());
    blocker_piece_.push_back(p);
  }
}

void Gather::add_if_between(std::size_t blocker, const Vec3& point, const Plane& horizon,
                            std::span<const Vec3> polygon, std::uint32_t piece,
                            Scratch& scratch) const {
  if (blocker_piece_[blocker] != piece &&
      may_block(blockers_[blocker], point, polygon, mesh_.pieces[piece].plane, tolerance_m_) &&
      any_beyond(blockers_[blocker].polygon, horizon, 1.0, tolerance_m_))
    scratch.blockers.push_back(&blockers_[blocker]);
}

// The part of the polygon in front of the element, less the shadows of scratch.blockers.
double Gather::factor_of_visible_parts(const Vec3& point, const Vec3& normal,
                                       std::span<const Vec3> polygon, const Plane& plane,
                                       Scratch& scratch) const {
  if (scratch.blockers.empty()) return point_to_polygon(point, normal, polygon);
  clip(polygon, {normal, normal.dot(point)}, 1e-13 * (polygon[0] - point).norm(), scratch.polygon);
  if (scratch.polygon.empty()) return 0.0;
  double factor = 0.0;
  for (const Polygon& part : scratch.parts(point, scratch.polygon, plane, scratch.blockers))
    factor += point_to_polygon(point, normal, part);
  return factor;
}

double Gather::visible_factor(const Vec3& point, const Vec3& normal, std::span<const Vec3> polygon,
                              std::uint32_t piece, Scratch& scratch) const {
  return visible_factor(point, normal, polygon, piece, blocker_piece_, scratch);
}

double Gather::visible_factor(const Vec3& point, const Vec3& normal, std::span<const Vec3> polygon,
                              std::uint32_t piece, std::span<const std::uint32_t> between,
                              Scratch& scratch) const {
  const Plane& plane = mesh_.pieces[piece].plane;
  if (plane.distance_m(point) <= tolerance_m_) return 0.0;  // sees its back or its edge
  const Plane horizon{normal, normal.dot(point)};
  if (!any_beyond(polygon, horizon, 1.0, tolerance_m_)) return 0.0;
  scratch.blockers.clear();
  for (std::uint32_t p : between)
    if (blocker_of_[p] != kNone)
      add_if_between(blocker_of_[p], point, horizon, polygon, piece, scratch);
  return factor_of_visible_parts(point, normal, polygon, plane, scratch);
}

// Of blockers that may hide a part of a piece, what each hides of the point's view.
void Gather::cast_shadows(const Vec3& point, std::span<const std::uint32_t> between,
                          Scratch& scratch) const {
  scratch.shadows.resize(std::max(scratch.shadows.size(), between.size()));
  for (std::size_t k = 0; k < between.size(); ++k)
    scratch.shadows[k].cast(point, blockers_[blocker_of_[between[k]]]);
}

// visible_factor of a part of that piece: most parts are clear of all these shadows, or lie in one.
double Gather::factor_between_shadows(const Vec3& point, const Vec3& normal,
                                      std::span<const Vec3> polygon, std::uint32_t piece,
                                      std::span<const std::uint32_t> between,
                                      Scratch& scratch) const {
  if (!any_beyond(polygon, {normal, normal.dot(point)}, 1.0, tolerance_m_)) return 0.0;
  const double tolerance_m = kShadowTolerance * (polygon[0] - point).norm();
  scratch.blockers.clear();
  for (std::size_t k = 0; k < between.size(); ++k) {
    if (scratch.shadows[k].misses(polygon, tolerance_m)) continue;
    if (scratch.shadows[k].covers(polygon, tolerance_m)) return 0.0;
    scratch.blockers.push_back(&blockers_[blocker_of_[between[k]]]);
  }
  return factor_of_visible_parts(point, normal, polygon, mesh_.pieces[piece].plane, scratch);
}

double Gather::mean_factor(std::uint32_t patch_index, std::uint32_t luminaire,
                           std::span<const std::uint32_t> between, Scratch& scratch) const {
  const Patch& patch = mesh_.patches[patch_index];
  const Plane& plane = mesh_.plane_of(patch);
  const Piece& piece = mesh_.pieces[luminaire];
  Polygon polygon;
  mesh_.polygon_of(patch, polygon);
  if (luminaire == patch.piece || !any_beyond(piece.polygon, plane, 1.0, tolerance_m_) ||
      !any_beyond(polygon, piece.plane, 1.0, tolerance_m_))
    return 0.0;
  if (between.empty())
    return exchange_area_m2(PlanarPolygon(polygon), PlanarPolygon(piece.polygon), 1e-12) /
           patch.area_m2;
  double factor = 0.0;
  for_each_gauss_point(polygon, kRulePoints, [&](const Vec3& point, double weight) {
    if (piece.plane.distance_m(point) <= tolerance_m_) return;
    const Plane horizon{plane.normal, plane.normal.dot(point)};
    scratch.blockers.clear();
    for (std::uint32_t p : between)
      if (blocker_of_[p] != kNone)
        add_if_between(blocker_of_[p], point, horizon, piece.polygon, luminaire, scratch);
    factor +=
        weight * factor_of_visible_parts(point, plane.normal, piece.polygon, piece.plane, scratch);
  });
  return factor;
}

void Gather::add_direct(const Vec3& point, const Vec3& normal,
                        Eigen::Ref<Eigen::VectorXd> irradiance, Scratch& scratch) const {
  for (std::uint32_t p : luminous_pieces_) {
    const Piece& piece = mesh_.pieces[p];
    const double factor = visible_factor(point, normal, piece.polygon, p, scratch);
    if (factor > 0.0)
      irradiance +=
          factor * as_vector(scene_.material_of(scene_.surfaces[piece.surface]).exitance.values);
  }
}

namespace {

// Two parts of a long quad, four of any other quad or triangle, a fan of triangles of anything
// else.
std::vector<Polygon> split(const Polygon& p) {
  constexpr double kLong = 2.2;  // between 2 and 4, so that halves of elements 2 : 1 are squares
  std::vector<Polygon> parts;
  const std::size_t n = p.size();
  if (n == 3 || n == 4) {
    Polygon middle(n);
    for (std::size_t i = 0; i < n; ++i) middle[i] = 0.5 * (p[i] + p[(i + 1) % n]);
    if (n == 3) {
      parts.push_back(middle);
      for (std::size_t i = 0; i < n; ++i) parts.push_back({middle[(i + 2) % n], p[i], middle[i]});
      return parts;
    }
    const double u = (middle[1] - middle[3]).norm(), v = (middle[2] - middle[0]).norm();
    if (u > kLong * v)
      return {{p[0], middle[0], middle[2], p[3]}, {middle[0], p[1], p[2], middle[2]}};
    if (v > kLong * u)
      return {{p[0], p[1], middle[1], middle[3]}, {middle[3], middle[1], p[2], p[3]}};
    const Vec3 centre = 0.25 * (p[0] + p[1] + p[2] + p[3]);
    for (std::size_t i = 0; i < n; ++i)
      parts.push_back({middle[(i + 3) % n], p[i], middle[i], centre});
  } else {
    for (std::size_t i = 2; i < n; ++i) parts.push_back({p[0], p[i - 1], p[i]});
  }
  return parts;
}

constexpr int kDeepestSplit =
    24;  // halvings, 2^-12 of an element: nearer points see rounding anyway

}  // namespace

struct Gather::PartWalk {
  const Gather& gather;
  const Vec3 &point, &normal;
  std::uint32_t piece;
  double near_field;
  const VisitPart& visit;
  Scratch& scratch;

  void run(const Polygon& polygon, int halvings, std::uint64_t path) const {
    if (!any_beyond(polygon, {normal, normal.dot(point)}, 1.0, gather.tolerance_m_)) return;
    const Vec3 centre = centroid(polygon);
    if (diameter_m(polygon) > near_field * (centre - point).norm() && halvings < kDeepestSplit) {
      const std::vector<Polygon> parts = split(polygon);
      const bool fits = path != 0 && path >> 60 == 0 && parts.size() <= 16;
      for (std::size_t k = 0; k < parts.size(); ++k)
        run(parts[k], halvings + (parts.size() == 2 ? 1 : 2), fits ? path << 4 | k : 0);
      return;
    }
    const double factor =
        gather.factor_between_shadows(point, normal, polygon, piece, scratch.in_view, scratch);
    if (factor > 0.0) visit(factor, {centre, halvings / 2, path});
  }
};

// Those of `between` whose shadow falls on the polygon: few, and its many parts ask these alone.
void Gather::keep_in_view(const Vec3& point, const Vec3& normal, std::span<const Vec3> polygon,
                          std::uint32_t piece, std::span<const std::uint32_t> between,
                          Scratch& scratch) const {
  const Plane horizon{normal, normal.dot(point)};
  const Plane& plane = mesh_.pieces[piece].plane;
  scratch.in_view.clear();
  for (std::uint32_t p : between) {
    if (blocker_of_[p] == kNone) continue;
    scratch.blockers.clear();
    add_if_between(blocker_of_[p], point, horizon, polygon, piece, scratch);
    if (scratch.blockers.empty()) continue;
    const auto parts = scratch.parts(point, polygon, plane, scratch.blockers);
    if (parts.size() != 1 ||
        !std::equal(parts[0].begin(), parts[0].end(), polygon.begin(), polygon.end()))
      scratch.in_view.push_back(p);
  }
}

void Gather::visit_parts(const Vec3& point, const Vec3& normal, const Polygon& polygon,
                         std::uint32_t piece, double near_field,
                         std::span<const std::uint32_t> between, const VisitPart& visit,
                         Scratch& scratch) const {
  if (mesh_.pieces[piece].plane.distance_m(point) <= tolerance_m_) return;
  keep_in_view(point, normal, polygon, piece, between, scratch);
  cast_shadows(point, scratch.in_view, scratch);
  PartWalk{*this, point, normal, piece, near_field, visit, scratch}.run(polygon, 0, 1);
}

BandMatrix Gather::from_surfaces(const Vec3& point, const Vec3& normal, const BandMatrix& radiosity,
                                 const SourceAt& source_at, Scratch& scratch) const {
  BandMatrix sum =
      BandMatrix::Zero(static_cast<Eigen::Index>(scene_.surfaces.size()), radiosity.cols());
  const Plane horizon{normal, normal.dot(point)};
  Polygon polygon;
  std::vector<std::uint32_t> between;  // of a piece: its elements need ask no others
  Eigen::VectorXd value(radiosity.cols());
  for (std::uint32_t p = 0; p < mesh_.pieces.size(); ++p) {
    const Piece& piece = mesh_.pieces[p];
    if (piece.plane.distance_m(point) <= tolerance_m_ ||
        !any_beyond(piece.polygon, horizon, 1.0, tolerance_m_))
      continue;
    keep_in_view(point, normal, piece.polygon, p, blocker_piece_, scratch);
    between = scratch.in_view;
    cast_shadows(point, between, scratch);
    if (!between.empty() &&
        visible_factor(point, normal, piece.polygon, p, between, scratch) == 0.0)
      continue;
    auto row = sum.row(static_cast<Eigen::Index>(piece.surface));
    for (std::uint32_t j = piece.first_patch; j < piece.first_patch + piece.patch_count; ++j) {
      mesh_.polygon_of(mesh_.patches[j], polygon);
      if (diameter_m(polygon) > kNearField * (mesh_.patches[j].centroid - point).norm()) {
        const auto add = [&](double factor, const Part& part) {
          source_at(j, part.centre, part.depth, value);
          row += factor * value.transpose();
        };
        visit_parts(point, normal, polygon, p, kNearField, between, add, scratch);
        cast_shadows(point, between, scratch);
        continue;
      }
      const double factor = factor_between_shadows(point, normal, polygon, p, between, scratch);
      if (factor > 0.0) row += factor * radiosity.row(j);
    }
  }
  return sum;
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "transport/convex_occluder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <tuple>
#include <utility>

namespace truebox {
namespace {

constexpr std::size_t kMostFaces = 16;    // of a solid; more would not pay
constexpr std::size_t kMostCorners = 16;  // of an end of a shaft

// A polygon without thickness: front, back, and a face across each edge.
ConvexOccluder sheet(const Blocker& polygon, std::uint32_t index) {
  ConvexOccluder solid;
  solid.members = {index};
  solid.corners = polygon.polygon;
  const Polygon& p = polygon.polygon;
  solid.faces = {polygon.plane, {-polygon.plane.normal, -polygon.plane.offset_m}};
  for (std::size_t k = 0; k < p.size(); ++k) {
    const Vec3 &a = p[k], &b = p[(k + 1) % p.size()];
    const Vec3 outward = (b - a).cross(polygon.plane.normal).normalized();
    const auto rim = static_cast<std::uint32_t>(solid.faces.size());
    solid.faces.push_back({outward, outward.dot(a)});
    solid.edges.push_back({a, b, 0, rim});
    solid.edges.push_back({b, a, 1, rim});
    solid.box.extend(a);
  }
  return solid;
}

using VertexId = std::uint32_t;
using DirectedEdge = std::pair<VertexId, VertexId>;

// Polygons by the edges they share, in opposite directions.
class Grouping {
 public:
  Grouping(std::span<const Blocker> polygons, double tolerance_m)
      : polygons_(polygons), tolerance_m_(tolerance_m), parent_(polygons.size()) {
    std::iota(parent_.begin(), parent_.end(), 0u);
    std::map<std::tuple<double, double, double>, VertexId> ids;
    for (std::uint32_t p = 0; p < polygons.size(); ++p) {
      auto& loop = loops_.emplace_back();
      for (const Vec3& v : polygons[p].polygon) {
        const auto [at, is_new] = ids.try_emplace({v.x(), v.y(), v.z()}, positions_.size());
        if (is_new) positions_.push_back(v);
        loop.push_back(at->second);
      }
      for (std::size_t k = 0; k < loop.size(); ++k) {
        const auto [at, is_new] = owner_.try_emplace({loop[k], loop[(k + 1) % loop.size()]}, p);
        if (!is_new) at->second = kSeveral;
      }
    }
    for (const auto& [edge, owner] : owner_)
      if (const auto other = owner_of({edge.second, edge.first}); other && owner != kSeveral)
        parent_[root(owner)] = root(*other);
  }

  std::vector<ConvexOccluder> run() {
    std::map<std::uint32_t, std::vector<std::uint32_t>> groups;
    for (std::uint32_t p = 0; p < polygons_.size(); ++p) groups[root(p)].push_back(p);
    std::vector<ConvexOccluder> solids;
    for (const auto& [key, members] : groups) {
      if (members.size() > 1 && members.size() <= kMostFaces)
        if (auto whole = solid(members)) {
          solids.push_back(std::move(*whole));
          continue;
        }
      for (std::uint32_t p : members) solids.push_back(sheet(polygons_[p], p));
    }
    return solids;
  }

 private:
  static constexpr std::uint32_t kSeveral = 0xffffffffu;

  std::uint32_t root(std::uint32_t p) {
    while (parent_[p] != p) p = parent_[p] = parent_[parent_[p]];
    return p;
  }

  std::optional<std::uint32_t> owner_of(const DirectedEdge& edge) const {
    const auto at = owner_.find(edge);
    if (at == owner_.end() || at->second == kSeveral) return std::nullopt;
    return at->second;
  }

  // Nothing if the polygons do not bound a convex body.
  std::optional<ConvexOccluder> solid(const std::vector<std::uint32_t>& members) const {
    ConvexOccluder result;
    result.members = members;
    std::map<std::uint32_t, std::uint32_t> face_of;
    for (std::uint32_t p : members) {
      face_of[p] = static_cast<std::uint32_t>(result.faces.size());
      result.faces.push_back(polygons_[p].plane);
      for (const Vec3& v : polygons_[p].polygon) result.corners.push_back(v);
    }
    std::map<VertexId, VertexId> rim;  // of the face that is missing, in its own direction
    const auto missing = static_cast<std::uint32_t>(result.faces.size());
    for (std::uint32_t p : members)
      for (std::size_t k = 0; k < loops_[p].size(); ++k) {
        const VertexId a = loops_[p][k], b = loops_[p][(k + 1) % loops_[p].size()];
        if (owner_of({a, b}) != p) return std::nullopt;
        const auto other = owner_of({b, a});
        if (!other && !rim.try_emplace(b, a).second) return std::nullopt;
        if (other && *other < p) continue;  // each edge once
        result.edges.push_back(
            {positions_[a], positions_[b], face_of[p], other ? face_of[*other] : missing});
      }
    if (!rim.empty() && !close(rim, result)) return std::nullopt;
    for (const Plane& face : result.faces) {
      double deepest_m = 0.0;
      for (const Vec3& v : result.corners) {
        if (face.distance_m(v) > tolerance_m_) return std::nullopt;
        deepest_m = std::min(deepest_m, face.distance_m(v));
      }
      // Both sides of a sheet, or parts of one polygon: without thickness, faces alone hide
      // nothing.
      if (deepest_m >= -tolerance_m_) return std::nullopt;
    }
    for (const Vec3& v : result.corners) result.box.extend(v);
    if (!rim.empty() && holds_something(result)) return std::nullopt;
    return result;
  }

  // From inside one could look out where a face is missing.
  bool holds_something(const ConvexOccluder& solid) const {
    return std::any_of(polygons_.begin(), polygons_.end(), [&](const Blocker& other) {
      Eigen::AlignedBox3d box;
      for (const Vec3& v : other.polygon) box.extend(v);
      if (!box.intersects(solid.box)) return false;
      return std::none_of(solid.faces.begin(), solid.faces.end(), [&](const Plane& face) {
        return std::all_of(other.polygon.begin(), other.polygon.end(),
                           [&](const Vec3& v) { return face.distance_m(v) >= -tolerance_m_; });
      });
    });
  }

  // Adds the plane of the missing face; false if its rim is not one loop.
  bool close(const std::map<VertexId, VertexId>& rim, ConvexOccluder& solid) const {
    Polygon loop;
    VertexId at = rim.begin()->first;
    do {
      loop.push_back(positions_[at]);
      const auto next = rim.find(at);
      if (next == rim.end() || loop.size() > rim.size()) return false;
      at = next->second;
    } while (at != rim.begin()->first);
    if (loop.size() != rim.size() || loop.size() < 3) return false;
    solid.faces.push_back(plane_of(loop));
    return std::all_of(loop.begin(), loop.end(), [&](const Vec3& v) {
      return std::abs(solid.faces.back().distance_m(v)) <= tolerance_m_;
    });
  }

  std::span<const Blocker> polygons_;
  double tolerance_m_;
  std::vector<std::uint32_t> parent_;
  std::vector<Vec3> positions_;
  std::vector<std::vector<VertexId>> loops_;
  std::map<DirectedEdge, std::uint32_t> owner_;
};

// The planes through an edge, as shares of the way from one face's plane to the other's, that have
// a corner with these heights over the two faces in front.
void keep_in_front(double height_left, double height_right, double& from, double& to) {
  if (height_left >= 0.0 && height_right >= 0.0) return;
  if (height_left < 0.0 && height_right < 0.0) {
    to = -1.0;
    return;
  }
  const double at = height_left / (height_left - height_right);
  if (height_left < 0.0)
    from = std::max(from, at);
  else
    to = std::min(to, at);
}

// A segment runs through the solid, and neither of its ends lies in it. Heights over all faces.
bool passes_through(const double* from, std::size_t stride_from, const double* to,
                    std::size_t stride_to, std::size_t faces, double tolerance) {
  double enter = 0.0, leave = 1.0;
  bool enters = false, leaves = false;
  for (std::size_t f = 0; f < faces; ++f, from += stride_from, to += stride_to) {
    if (*from > tolerance) {
      if (*to > tolerance) return false;
      enters = true;
      enter = std::max(enter, (*from - tolerance) / (*from - *to));
    } else if (*to > tolerance) {
      leaves = true;
      leave = std::min(leave, (tolerance - *from) / (*to - *from));
    }
    if (enter > leave) return false;
  }
  return enters && leaves;
}

bool any_in_front(std::span<const Vec3> points, const Plane& plane, double tolerance) {
  return std::any_of(points.begin(), points.end(),
                     [&](const Vec3& v) { return plane.distance_m(v) > tolerance; });
}

}  // namespace

std::vector<ConvexOccluder> convex_occluders(std::span<const Blocker> polygons,
                                             double tolerance_m) {
  return Grouping(polygons, tolerance_m).run();
}

void MeasuredEnd::measure(std::span<const Vec3> polygon, const Plane& plane,
                          const ConvexOccluder& solid, double tolerance_m) {
  const std::size_t faces = solid.faces.size();
  corners = polygon.size() > kMostCorners || faces > kMostFaces + 1 ? 0 : polygon.size();
  front = 0;
  values.clear();
  sees_solid = any_in_front(solid.corners, plane, tolerance_m);
  if (!sees_solid || corners == 0) return;
  values.reserve(faces * corners + 2 * solid.edges.size());
  for (std::size_t f = 0; f < faces; ++f) {
    bool behind = false;
    for (const Vec3& v : polygon) {
      values.push_back(solid.faces[f].distance_m(v));
      behind |= values.back() < -tolerance_m;
    }
    front |= static_cast<std::uint32_t>(!behind) << f;
  }
  for (const ConvexOccluder::Edge& edge : solid.edges) {
    double from = 0.0, to = 1.0;
    for (std::size_t k = 0; k < corners; ++k)
      keep_in_front(values[edge.left * corners + k] + tolerance_m,
                    values[edge.right * corners + k] + tolerance_m, from, to);
    values.push_back(from);
    values.push_back(to);
  }
}

ShaftOcclusion shaft_occlusion(const MeasuredEnd& a, const MeasuredEnd& b,
                               const ConvexOccluder& solid, double tolerance_m) {
  if (a.corners == 0 || b.corners == 0) return ShaftOcclusion::partial;
  if (!a.sees_solid || !b.sees_solid || (a.front & b.front) != 0) return ShaftOcclusion::none;
  const std::size_t faces = solid.faces.size();
  const double* planes_a = a.values.data() + faces * a.corners;
  const double* planes_b = b.values.data() + faces * b.corners;
  for (std::size_t e = 0; e < 2 * solid.edges.size(); e += 2)
    if (std::max(planes_a[e], planes_b[e]) <= std::min(planes_a[e + 1], planes_b[e + 1]))
      return ShaftOcclusion::none;
  for (std::size_t k = 0; k < a.corners; ++k)
    for (std::size_t l = 0; l < b.corners; ++l)
      if (!passes_through(&a.values[k], a.corners, &b.values[l], b.corners, faces, tolerance_m))
        return ShaftOcclusion::partial;
  return ShaftOcclusion::full;
}

ShaftOcclusion shaft_occlusion(std::span<const Vec3> a, const Plane& plane_a,
                               std::span<const Vec3> b, const Plane& plane_b,
                               const ConvexOccluder& solid, double tolerance_m) {
  MeasuredEnd end_a, end_b;
  end_a.measure(a, plane_a, solid, tolerance_m);
  if (end_a.corners != 0 && !end_a.sees_solid) return ShaftOcclusion::none;
  end_b.measure(b, plane_b, solid, tolerance_m);
  return shaft_occlusion(end_a, end_b, solid, tolerance_m);
}

}  // namespace truebox

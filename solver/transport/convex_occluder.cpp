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
constexpr std::size_t kMostCorners = 32;  // of both ends of a shaft

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

// Corners of both ends of a shaft and their heights over the faces of a solid.
struct Shaft {
  std::size_t ends_a, count;
  std::array<double, kMostCorners> x, y, z;
  std::array<std::array<double, kMostCorners>, kMostFaces + 1> heights;
  std::array<std::uint32_t, kMostFaces + 1> behind;  // bit k: corner k lies behind the face

  Shaft(std::span<const Vec3> a, std::span<const Vec3> b)
      : ends_a(a.size()), count(a.size() + b.size()) {
    for (std::size_t k = 0; k < count; ++k) {
      const Vec3& v = k < ends_a ? a[k] : b[k - ends_a];
      x[k] = v.x();
      y[k] = v.y();
      z[k] = v.z();
    }
  }

  void measure(std::size_t f, const Plane& face, double tolerance) {
    const double nx = face.normal.x(), ny = face.normal.y(), nz = face.normal.z();
    std::array<double, kMostCorners>& height = heights[f];
    for (std::size_t k = 0; k < count; ++k)
      height[k] = nx * x[k] + ny * y[k] + nz * z[k] - face.offset_m;
    behind[f] = 0;
    for (std::size_t k = 0; k < count; ++k)
      behind[f] |= static_cast<std::uint32_t>(height[k] < -tolerance) << k;
  }

  // Whether a face, or a plane between those of the two faces at an edge, keeps all apart.
  bool is_apart_from(const ConvexOccluder& solid, double tolerance) {
    for (std::size_t f = 0; f < solid.faces.size(); ++f) {
      measure(f, solid.faces[f], tolerance);
      if (behind[f] == 0) return true;
    }
    for (const ConvexOccluder::Edge& edge : solid.edges)
      if ((behind[edge.left] & behind[edge.right]) == 0 &&
          all_beyond_edge(edge.left, edge.right, tolerance))
        return true;
    return false;
  }

  // Some plane through the edge of two faces, between theirs, has all corners in front.
  bool all_beyond_edge(std::size_t f, std::size_t g, double tolerance) const {
    double low = 0.0, high = 1.0;
    for (std::size_t k = 0; k < count; ++k) {
      const double h_f = heights[f][k] + tolerance, h_g = heights[g][k] + tolerance;
      if (h_f >= 0.0 && h_g >= 0.0) continue;
      if (h_f < 0.0 && h_g < 0.0) return false;
      const double at = h_f / (h_f - h_g);
      if (h_f < 0.0)
        low = std::max(low, at);
      else
        high = std::min(high, at);
      if (low > high) return false;
    }
    return true;
  }

  // Every segment from a corner of one end to one of the other runs through the solid, and neither
  // of its ends lies in it.
  bool all_pass_through(std::size_t faces, double tolerance) const {
    for (std::size_t k = 0; k < ends_a; ++k)
      for (std::size_t l = ends_a; l < count; ++l)
        if (!passes_through(k, l, faces, tolerance)) return false;
    return true;
  }

  bool passes_through(std::size_t k, std::size_t l, std::size_t faces, double tolerance) const {
    double enter = 0.0, leave = 1.0;
    bool enters = false, leaves = false;
    for (std::size_t f = 0; f < faces; ++f) {
      const double from = heights[f][k], to = heights[f][l];
      if (from > tolerance) {
        if (to > tolerance) return false;
        enters = true;
        enter = std::max(enter, (from - tolerance) / (from - to));
      } else if (to > tolerance) {
        leaves = true;
        leave = std::min(leave, (tolerance - from) / (to - from));
      }
      if (enter > leave) return false;
    }
    return enters && leaves;
  }
};

bool any_in_front(std::span<const Vec3> points, const Plane& plane, double tolerance) {
  return std::any_of(points.begin(), points.end(),
                     [&](const Vec3& v) { return plane.distance_m(v) > tolerance; });
}

}  // namespace

std::vector<ConvexOccluder> convex_occluders(std::span<const Blocker> polygons,
                                             double tolerance_m) {
  return Grouping(polygons, tolerance_m).run();
}

ShaftOcclusion shaft_occlusion(std::span<const Vec3> a, const Plane& plane_a,
                               std::span<const Vec3> b, const Plane& plane_b,
                               const ConvexOccluder& solid, double tolerance_m) {
  if (a.size() + b.size() > kMostCorners || solid.faces.size() > kMostFaces + 1)
    return ShaftOcclusion::partial;
  if (!any_in_front(solid.corners, plane_a, tolerance_m) ||
      !any_in_front(solid.corners, plane_b, tolerance_m))
    return ShaftOcclusion::none;
  Shaft shaft(a, b);
  if (shaft.is_apart_from(solid, tolerance_m)) return ShaftOcclusion::none;
  return shaft.all_pass_through(solid.faces.size(), tolerance_m) ? ShaftOcclusion::full
                                                                 : ShaftOcclusion::partial;
}

}  // namespace truebox

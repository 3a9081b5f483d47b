// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/edge_layers.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "mesh/add_piece.h"

namespace truebox {
namespace {

constexpr double kTouching = 1e-7;  // of a piece's size
constexpr double kSameLine = 5e-2;  // of a layer's distance: closer corners are not cut off
constexpr double kParallel = 1e-9;  // sine of the angle between planes

struct Interval {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  void extend(double t) {
    low = std::min(low, t);
    high = std::max(high, t);
  }
};

// What a convex polygon has of a plane, along a direction of that plane.
Interval part_in(const Polygon& polygon, const Plane& plane, const Vec3& origin,
                 const Vec3& direction, double tolerance_m) {
  Interval part;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec3 &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double da = plane.distance_m(a), db = plane.distance_m(b);
    if (std::abs(da) <= tolerance_m) part.extend(direction.dot(a - origin));
    if ((da > tolerance_m && db < -tolerance_m) || (da < -tolerance_m && db > tolerance_m))
      part.extend(direction.dot(a + da / (da - db) * (b - a) - origin));
  }
  return part;
}

bool any_in_front(const Polygon& polygon, const Plane& plane, double tolerance_m) {
  return std::any_of(polygon.begin(), polygon.end(),
                     [&](const Vec3& v) { return plane.distance_m(v) > tolerance_m; });
}

// Where two pieces that face each other touch, if they do along more than a point.
std::optional<ContactLine> meeting_line(const Piece& p, const Piece& q) {
  const double tolerance = kTouching * std::max(p.diameter_m, q.diameter_m);
  const Vec3 cross = p.plane.normal.cross(q.plane.normal);
  if (cross.norm() < kParallel || !any_in_front(q.polygon, p.plane, tolerance) ||
      !any_in_front(p.polygon, q.plane, tolerance))
    return std::nullopt;
  // The point of both planes nearest to p's first corner.
  const Vec3& corner = p.polygon[0];
  const Vec3 in_p = cross.cross(p.plane.normal);  // lies in p, across the line
  const Vec3 origin = corner - q.plane.distance_m(corner) / q.plane.normal.dot(in_p) * in_p;
  const Vec3 direction = cross.normalized();
  const Interval a = part_in(p.polygon, q.plane, origin, direction, tolerance);
  const Interval b = part_in(q.polygon, p.plane, origin, direction, tolerance);
  const double low = std::max(a.low, b.low), high = std::min(a.high, b.high);
  if (!(high - low > 10.0 * tolerance)) return std::nullopt;
  return ContactLine{origin + low * direction, origin + high * direction};
}

// A meeting line in the coordinates of its piece, with the width of the elements along it.
struct Zone {
  Vec3 from, along, across;
  double length_m, width_m = 0.0;

  double across_m(const Vec3& v) const { return across.dot(v - from); }
  double along_m(const Vec3& v) const { return along.dot(v - from); }

  bool touches(const Polygon& element, double tolerance_m) const {
    return std::any_of(element.begin(), element.end(), [&](const Vec3& v) {
      return std::abs(across_m(v)) < tolerance_m && along_m(v) > -tolerance_m &&
             along_m(v) < length_m + tolerance_m;
    });
  }
  bool reaches(const Polygon& element) const {
    Interval x, t;
    for (const Vec3& v : element) {
      x.extend(across_m(v));
      t.extend(along_m(v));
    }
    const double margin = 1e-3 * width_m;
    return x.low < width_m - margin && x.high > margin - width_m && t.high > margin - width_m &&
           t.low < length_m + width_m - margin;
  }
};

// The extent across a zone's line of the usable elements that touch it.
double width_of(const Zone& zone, const PatchMesh& mesh, const Piece& piece,
                const std::vector<char>& usable) {
  double width_m = 0.0;
  Polygon element;
  for (std::uint32_t i = piece.first_patch; i < piece.first_patch + piece.patch_count; ++i) {
    if (!usable[i]) continue;
    mesh.polygon_of(mesh.patches[i], element);
    if (!zone.touches(element, 10.0 * kTouching * piece.diameter_m)) continue;
    for (const Vec3& v : element) width_m = std::max(width_m, std::abs(zone.across_m(v)));
  }
  return width_m;
}

// One a meeting line; and one across it where it ends at no other: what meets it there ends too,
// and the light around such a tip depends on the direction one comes from.
std::vector<Zone> zones_of(const PatchMesh& mesh, const Scene& scene, std::uint32_t index,
                           const std::vector<char>& usable) {
  const Piece& piece = mesh.pieces[index];
  const std::vector<ContactLine> lines = meeting_lines(mesh, scene, index);
  std::vector<Zone> zones;
  const auto add = [&](Zone zone) {
    zone.width_m = width_of(zone, mesh, piece, usable);
    if (zone.width_m > 0.0) zones.push_back(zone);
  };
  for (const ContactLine& line : lines) {
    const Vec3 along = (line.to - line.from).normalized();
    const Vec3 across = piece.plane.normal.cross(along);
    add({line.from, along, across, (line.to - line.from).norm()});
    for (const Vec3& end : {line.from, line.to}) {
      const double tolerance = 100.0 * kTouching * piece.diameter_m;
      const auto meets_it = [&](const ContactLine& other) {
        const Vec3 way = other.to - other.from;
        const double t = std::clamp(way.dot(end - other.from) / way.squaredNorm(), 0.0, 1.0);
        return &other != &line && (other.from + t * way - end).norm() < tolerance;
      };
      if (std::none_of(lines.begin(), lines.end(), meets_it)) add({end, across, along, 0.0});
    }
  }
  return zones;
}

// Where a piece passes through the plane of another one close by: on one side it sees that surface,
// on the other it does not, and the irradiance has a kink.
struct Horizon {
  Plane plane;
  Eigen::AlignedBox3d box;
  double reach_m;
};

std::vector<Horizon> horizons_of(const PatchMesh& mesh, const Scene& scene, const Piece& piece) {
  std::vector<Horizon> horizons;
  for (const Piece& other : mesh.pieces) {
    const double tolerance = 1e-3 * piece.diameter_m;
    if (scene.surfaces[other.surface].is_opening ||
        !any_in_front(other.polygon, piece.plane, tolerance) ||
        !any_in_front(piece.polygon, other.plane, tolerance) ||
        !any_in_front(piece.polygon, {-other.plane.normal, -other.plane.offset_m}, tolerance))
      continue;
    Horizon& horizon = horizons.emplace_back(Horizon{other.plane, {}, other.diameter_m});
    for (const Vec3& v : other.polygon) horizon.box.extend(v);
  }
  return horizons;
}

void cut_at(const Plane& plane, double tolerance_m, std::vector<Polygon>& cells) {
  const std::size_t count = cells.size();
  Polygon front, back;
  for (std::size_t c = 0; c < count; ++c) {
    if (!any_in_front(cells[c], plane, tolerance_m) ||
        !any_in_front(cells[c], {-plane.normal, -plane.offset_m}, tolerance_m))
      continue;
    clip(cells[c], plane, tolerance_m, front);
    clip(cells[c], {-plane.normal, -plane.offset_m}, tolerance_m, back);
    if (front.size() < 3 || back.size() < 3) continue;
    cells[c] = front;
    cells.push_back(back);
  }
}

}  // namespace

std::vector<ContactLine> meeting_lines(const PatchMesh& mesh, const Scene& scene,
                                       std::uint32_t piece) {
  std::vector<ContactLine> lines;
  if (scene.surfaces[mesh.pieces[piece].surface].is_opening) return lines;
  for (std::uint32_t q = 0; q < mesh.pieces.size(); ++q) {
    if (q == piece || scene.surfaces[mesh.pieces[q].surface].is_opening) continue;
    if (const auto line = meeting_line(mesh.pieces[piece], mesh.pieces[q])) lines.push_back(*line);
  }
  return lines;
}

LayeredMesh layered_mesh(const PatchMesh& mesh, const std::vector<std::vector<Polygon>>& cells_of) {
  LayeredMesh result;
  result.first_cell.reserve(mesh.size() + 1);
  std::vector<Polygon> all;
  for (const Piece& piece : mesh.pieces) {
    all.clear();
    for (std::uint32_t i = piece.first_patch; i < piece.first_patch + piece.patch_count; ++i) {
      result.first_cell.push_back(static_cast<std::uint32_t>(result.parent.size()));
      result.parent.insert(result.parent.end(), cells_of[i].size(), i);
      all.insert(all.end(), cells_of[i].begin(), cells_of[i].end());
    }
    add_piece(result.mesh, piece.surface, piece.polygon, piece.contacts, all);
  }
  result.first_cell.push_back(static_cast<std::uint32_t>(result.parent.size()));
  return result;
}

LayeredMesh edge_layers(const PatchMesh& mesh, const Scene& scene, const std::vector<char>& usable,
                        int layers) {
  std::vector<std::vector<Polygon>> cells_of(mesh.size());
  for (std::uint32_t p = 0; p < mesh.pieces.size(); ++p) {
    const Piece& piece = mesh.pieces[p];
    const std::vector<Zone> zones = zones_of(mesh, scene, p, usable);
    const std::vector<Horizon> horizons = horizons_of(mesh, scene, piece);
    for (std::uint32_t i = piece.first_patch; i < piece.first_patch + piece.patch_count; ++i) {
      std::vector<Polygon>& cells = cells_of[i];
      cells.assign(1, {});
      mesh.polygon_of(mesh.patches[i], cells[0]);
      const Polygon element = cells[0];
      for (const Zone& zone : zones) {
        if (!usable[i] || !zone.reaches(element)) continue;
        for (double distance_m = 0.5 * zone.width_m;
             distance_m > 0.75 * std::ldexp(zone.width_m, -layers); distance_m *= 0.5)
          for (const double side : {-1.0, 1.0})
            cut_at({zone.across, zone.across.dot(zone.from) + side * distance_m},
                   kSameLine * distance_m, cells);
      }
      for (const Horizon& horizon : horizons)
        if (usable[i] && horizon.box.exteriorDistance(mesh.patches[i].centroid) < horizon.reach_m)
          cut_at(horizon.plane, kSameLine * std::sqrt(mesh.patches[i].area_m2), cells);
    }
  }
  return layered_mesh(mesh, cells_of);
}

}  // namespace truebox

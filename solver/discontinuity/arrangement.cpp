// SPDX-License-Identifier: BSD-3-Clause
#include "discontinuity/arrangement.h"

#include <geos_c.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace truebox {
namespace {

// GEOS's C interface, with errors as exceptions and geometries that free themselves.
class Geos {
 public:
  struct Free {
    GEOSContextHandle_t context = nullptr;
    void operator()(GEOSGeometry* geometry) const { GEOSGeom_destroy_r(context, geometry); }
  };
  using Geometry = std::unique_ptr<GEOSGeometry, Free>;

  Geos() : context_(GEOS_init_r()) {}
  Geos(const Geos&) = delete;
  Geos& operator=(const Geos&) = delete;
  ~Geos() { GEOS_finish_r(context_); }

  Geometry lines(const PlanePolygon& outline, const std::vector<PlaneSegment>& segments) const {
    std::vector<GEOSGeometry*> parts;
    for (std::size_t k = 0; k < outline.size(); ++k)
      parts.push_back(line(outline[k], outline[(k + 1) % outline.size()]));
    for (const PlaneSegment& s : segments) parts.push_back(line(s.from, s.to));
    return own(GEOSGeom_createCollection_r(context_, GEOS_MULTILINESTRING, parts.data(),
                                           static_cast<unsigned>(parts.size())));
  }
  Geometry noded(const GEOSGeometry* lines, double snap_m) const {
    return own(GEOSUnaryUnionPrec_r(context_, lines, snap_m));
  }
  Geometry faces(const GEOSGeometry* lines) const {
    return own(GEOSPolygonize_r(context_, &lines, 1));
  }
  Geometry triangulated(const GEOSGeometry* face) const {
    return own(GEOSConstrainedDelaunayTriangulation_r(context_, face));
  }

  int parts(const GEOSGeometry* collection) const {
    return GEOSGetNumGeometries_r(context_, collection);
  }
  const GEOSGeometry* part(const GEOSGeometry* collection, int k) const {
    return GEOSGetGeometryN_r(context_, collection, k);
  }
  bool has_holes(const GEOSGeometry* face) const {
    return GEOSGetNumInteriorRings_r(context_, face) > 0;
  }

  // The outer ring, counter-clockwise, its first corner once.
  PlanePolygon outline_of(const GEOSGeometry* face) const {
    const GEOSGeometry* ring = GEOSGetExteriorRing_r(context_, face);
    const GEOSCoordSequence* corners = ring ? GEOSGeom_getCoordSeq_r(context_, ring) : nullptr;
    unsigned size = 0;
    if (!corners || !GEOSCoordSeq_getSize_r(context_, corners, &size)) fail();
    PlanePolygon outline;
    double twice_area = 0.0;
    for (unsigned k = 0; k + 1 < size; ++k) {
      Vec2 x;
      if (!GEOSCoordSeq_getXY_r(context_, corners, k, &x.x(), &x.y())) fail();
      outline.push_back(x);
    }
    for (std::size_t k = 0; k < outline.size(); ++k)
      twice_area += cross(outline[k], outline[(k + 1) % outline.size()]);
    if (twice_area < 0.0) std::reverse(outline.begin(), outline.end());
    return outline;
  }

 private:
  [[noreturn]] static void fail() {
    throw std::runtime_error("the lines of light and blockers could not be made a mesh (GEOS)");
  }
  Geometry own(GEOSGeometry* geometry) const {
    if (!geometry) fail();
    return Geometry(geometry, Free{context_});
  }
  GEOSGeometry* line(const Vec2& from, const Vec2& to) const {
    const std::array<double, 4> xy = {from.x(), from.y(), to.x(), to.y()};
    GEOSCoordSequence* corners = GEOSCoordSeq_copyFromBuffer_r(context_, xy.data(), 2, 0, 0);
    GEOSGeometry* made = corners ? GEOSGeom_createLineString_r(context_, corners) : nullptr;
    if (!made) fail();
    return made;
  }

  GEOSContextHandle_t context_;
};

double angle_at(const PlanePolygon& p, std::size_t k) {
  const std::size_t n = p.size();
  const Vec2 next = p[(k + 1) % n] - p[k], before = p[(k + n - 1) % n] - p[k];
  return std::atan2(cross(next, before), next.dot(before));
}

// The largest departure of a quad's angles from 90 degrees.
double skewness_rad(const PlanePolygon& quad) {
  double worst = 0.0;
  for (std::size_t k = 0; k < 4; ++k)
    worst = std::max(worst, std::abs(angle_at(quad, k) - 0.5 * std::numbers::pi));
  return worst;
}

constexpr double kMostSkewed_rad = 0.9;  // 52 degrees: beyond, two triangles serve as well
constexpr double kStraight_rad = 1e-5;   // where lines end on an edge, moved by rounding

// A corner that a polygon has inside its edge.
struct InsideEdge {
  Vec2 corner, from, to;
};

struct Simplified {
  PlanePolygon outline;
  std::vector<InsideEdge> left_out;
};

Simplified without_straight_corners(const PlanePolygon& p) {
  Simplified s;
  std::vector<std::size_t> kept;
  for (std::size_t k = 0; k < p.size(); ++k)
    if (std::abs(std::abs(angle_at(p, k)) - std::numbers::pi) > kStraight_rad) kept.push_back(k);
  for (std::size_t e = 0; e < kept.size(); ++e) {
    const std::size_t next = kept[(e + 1) % kept.size()];
    s.outline.push_back(p[kept[e]]);
    for (std::size_t k = (kept[e] + 1) % p.size(); k != next; k = (k + 1) % p.size())
      s.left_out.push_back({p[k], p[kept[e]], p[next]});
  }
  return s;
}

// Where corners are once they have been moved exactly onto the edges they stand on.
class Places {
 public:
  Places(const PlanePolygon& outline, double snap_m) : outline_(outline), snap_m_(snap_m) {}

  void add(const std::vector<InsideEdge>& corners) {
    inside_edges_.insert(inside_edges_.end(), corners.begin(), corners.end());
  }

  void apply(std::vector<PlanePolygon>& cells) {
    for (const PlanePolygon& cell : cells)
      for (const Vec2& corner : cell) place_[key(corner)] = on_outline(corner);
    // One edge's corner may stand on another's edge: round by round they settle.
    double moved_m = snap_m_;
    for (int round = 0; round < kMostRounds && moved_m > kSettled * snap_m_; ++round) {
      moved_m = 0.0;
      for (const auto& [corner, from, to] : inside_edges_) {
        const auto found = place_.find(key(corner));
        if (found == place_.end() || is_on_outline(corner)) continue;
        const Vec2 a = place_.at(key(from)), along = place_.at(key(to)) - a;
        const Vec2 foot = a + along.dot(found->second - a) / along.squaredNorm() * along;
        moved_m = std::max(moved_m, (foot - found->second).norm());
        found->second = foot;
      }
    }
    for (PlanePolygon& cell : cells)
      for (Vec2& corner : cell) corner = place_.at(key(corner));
  }

 private:
  static constexpr int kMostRounds = 2000;
  static constexpr double kSettled = 1e-9;  // 2^-24 of a piece times that is rounding
  static std::pair<double, double> key(const Vec2& x) { return {x.x(), x.y()}; }

  bool is_on_outline(const Vec2& x) const { return on_outline(x) != x; }

  Vec2 on_outline(const Vec2& x) const {
    for (const Vec2& corner : outline_)
      if ((corner - x).norm() < 2.0 * snap_m_) return corner;
    for (std::size_t k = 0; k < outline_.size(); ++k) {
      const Vec2 along = outline_[(k + 1) % outline_.size()] - outline_[k];
      const Vec2 foot = outline_[k] + along.dot(x - outline_[k]) / along.squaredNorm() * along;
      if ((foot - x).norm() < 2.0 * snap_m_) return foot;
    }
    return x;
  }

  const PlanePolygon& outline_;
  double snap_m_;
  std::vector<InsideEdge> inside_edges_;
  std::map<std::pair<double, double>, Vec2> place_;
};

// Triangles of one face, paired to quads across the edges they share, the squarest first.
void add_paired(const std::vector<PlanePolygon>& triangles, std::vector<PlanePolygon>& cells) {
  using Corner = std::pair<double, double>;
  std::map<std::pair<Corner, Corner>, std::pair<std::size_t, std::size_t>> open;
  struct Pair {
    double skewness_rad;
    std::size_t first, second;
    PlanePolygon quad;
  };
  std::vector<Pair> pairs;
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec2 &a = triangles[t][k], &b = triangles[t][(k + 1) % 3];
      const Corner from{a.x(), a.y()}, to{b.x(), b.y()};
      const auto found = open.find({to, from});
      if (found == open.end()) {
        open[{from, to}] = {t, k};
        continue;
      }
      const auto [other, edge] = found->second;
      PlanePolygon quad = {a, triangles[other][(edge + 2) % 3], b, triangles[t][(k + 2) % 3]};
      const double skewed_rad = skewness_rad(quad);
      if (skewed_rad < kMostSkewed_rad) pairs.push_back({skewed_rad, other, t, std::move(quad)});
    }
  std::sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) {
    return std::tie(a.skewness_rad, a.first, a.second) <
           std::tie(b.skewness_rad, b.first, b.second);
  });
  std::vector<char> taken(triangles.size(), 0);
  for (Pair& pair : pairs) {
    if (taken[pair.first] || taken[pair.second]) continue;
    taken[pair.first] = taken[pair.second] = 1;
    cells.push_back(std::move(pair.quad));
  }
  for (std::size_t t = 0; t < triangles.size(); ++t)
    if (!taken[t]) cells.push_back(triangles[t]);
}

void add_cells_of_face(const Geos& geos, const GEOSGeometry* face, Places& places,
                       std::vector<PlanePolygon>& cells) {
  if (!geos.has_holes(face)) {
    Simplified simple = without_straight_corners(geos.outline_of(face));
    const PlanePolygon& outline = simple.outline;
    if (outline.size() == 3 || (outline.size() == 4 && skewness_rad(outline) < kMostSkewed_rad)) {
      places.add(simple.left_out);
      cells.push_back(std::move(simple.outline));
      return;
    }
  }
  const Geos::Geometry triangulated = geos.triangulated(face);
  std::vector<PlanePolygon> triangles;
  for (int k = 0; k < geos.parts(triangulated.get()); ++k) {
    triangles.push_back(geos.outline_of(geos.part(triangulated.get(), k)));
    if (triangles.back().size() != 3) triangles.pop_back();
  }
  add_paired(triangles, cells);
}

}  // namespace

std::vector<PlanePolygon> cells_between_lines(const PlanePolygon& outline,
                                              const std::vector<PlaneSegment>& segments,
                                              double snap_m) {
  const Geos geos;
  const Geos::Geometry lines = geos.lines(outline, segments);
  const Geos::Geometry noded = geos.noded(lines.get(), snap_m);
  const Geos::Geometry faces = geos.faces(noded.get());
  std::vector<PlanePolygon> cells;
  Places places(outline, snap_m);
  for (int k = 0; k < geos.parts(faces.get()); ++k)
    add_cells_of_face(geos, geos.part(faces.get(), k), places, cells);
  places.apply(cells);
  return cells;
}

}  // namespace truebox

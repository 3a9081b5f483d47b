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
#include <tuple>
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

PlanePolygon without_straight_corners(const PlanePolygon& p) {
  PlanePolygon kept;
  for (std::size_t k = 0; k < p.size(); ++k)
    if (std::abs(std::abs(angle_at(p, k)) - std::numbers::pi) > kStraight_rad) kept.push_back(p[k]);
  return kept;
}

// Puts corners, which noding has moved by up to a snap, back exactly onto the lines they stand on:
// elements beside a line of contact must touch what stands there, not leave a gap of 1e-8.
class Rails {
 public:
  Rails(const PlanePolygon& outline, const std::vector<PlaneSegment>& segments, double snap_m)
      : reach_m_(2.0 * snap_m) {
    for (std::size_t k = 0; k < outline.size(); ++k)
      rails_.push_back({outline[k], outline[(k + 1) % outline.size()]});
    rails_.insert(rails_.end(), segments.begin(), segments.end());
  }

  Vec2 placed(const Vec2& x) const {
    for (const PlaneSegment& rail : rails_)
      for (const Vec2& end : {rail.from, rail.to})
        if ((end - x).norm() < reach_m_) return end;
    const PlaneSegment* first = nullptr;
    for (const PlaneSegment& rail : rails_) {
      if (!passes(rail, x)) continue;
      if (!first) {
        first = &rail;
        continue;
      }
      const double sine = cross(first->direction(), rail.direction());
      if (std::abs(sine) < kParallel) continue;
      return first->from +
             cross(rail.from - first->from, rail.direction()) / sine * first->direction();
    }
    if (!first) return x;
    return first->from + first->direction().dot(x - first->from) * first->direction();
  }

 private:
  static constexpr double kParallel = 1e-3;  // sine: what crosses at less is one line here

  bool passes(const PlaneSegment& rail, const Vec2& x) const {
    const double at_m = rail.direction().dot(x - rail.from);
    return at_m > -reach_m_ && at_m < rail.length_m() + reach_m_ &&
           std::abs(cross(rail.direction(), x - rail.from)) < reach_m_;
  }

  std::vector<PlaneSegment> rails_;  // the outline first: it counts for more
  double reach_m_;
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

void add_cells_of_face(const Geos& geos, const GEOSGeometry* face,
                       std::vector<PlanePolygon>& cells) {
  if (!geos.has_holes(face)) {
    PlanePolygon outline = without_straight_corners(geos.outline_of(face));
    if (outline.size() == 3 || (outline.size() == 4 && skewness_rad(outline) < kMostSkewed_rad)) {
      cells.push_back(std::move(outline));
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
  for (int k = 0; k < geos.parts(faces.get()); ++k)
    add_cells_of_face(geos, geos.part(faces.get(), k), cells);
  const Rails rails(outline, segments, snap_m);
  for (PlanePolygon& cell : cells)
    for (Vec2& corner : cell) corner = rails.placed(corner);
  return cells;
}

}  // namespace truebox

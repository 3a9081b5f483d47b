// SPDX-License-Identifier: BSD-3-Clause
#include "transport/view_events.h"

#include <algorithm>
#include <cmath>

namespace truebox {
namespace {

// Projections that run out to the horizon end where they are this much of the source's height.
constexpr double kBelowSource = 1e-6;
constexpr double kOnReceiver = 1e-12;  // of its radius: heights that are rounding

bool same(const Vec3& a, const Vec3& b, double tolerance) { return (a - b).norm() <= tolerance; }

constexpr double kInOnePlane = 1e-9;  // sine of the angle to it

class EventFinder {
 public:
  EventFinder(const PlanarPolygon& receiver, const PlanarPolygon& source)
      : receiver_(receiver), source_(source) {}

  std::vector<ViewEvent> run(std::span<const Blocker* const> blockers) {
    blockers_ = blockers;
    for (const Blocker* blocker : blockers_) {
      cut_by_plane(blocker->plane);
      cut_by_blocker(*blocker);
    }
    return std::move(events_);
  }

  std::vector<ViewEvent> run(std::span<const ConvexOccluder* const> solids) {
    for (const ConvexOccluder* solid : solids) cut_by_solid(*solid);
    // A corner of one before an edge of another: a gap between them opens or closes.
    for (const ConvexOccluder* near : solids)
      for (const ConvexOccluder* far : solids)
        if (near != far) cut_by_two(*near, *far);
    return std::move(events_);
  }

 private:
  double height(const Vec3& v) const { return receiver_.plane.distance_m(v); }

  void cut_by_plane(const Plane& plane) {
    Polygon crossing;
    const Polygon& p = receiver_.vertices;
    for (std::size_t k = 0; k < p.size(); ++k) {
      const Vec3 &a = p[k], &b = p[(k + 1) % p.size()];
      const double h = plane.distance_m(a), g = plane.distance_m(b);
      if ((h > 0.0) != (g > 0.0)) crossing.push_back(a + h / (h - g) * (b - a));
    }
    if (crossing.size() == 2) events_.push_back({crossing[0], crossing[1], false});
  }

  // An edge that two blockers share inside their common outline is no outline of the shadow.
  bool is_inner_edge(const Blocker& blocker, const Vec3& a, const Vec3& b) const {
    const double tolerance = 1e-12 * (a - b).norm();
    const auto sees = [&](const Blocker& other) {  // 1: its front, -1: its back, 0: both
      bool front = false, behind = false;
      for (const Vec3& v : receiver_.vertices) {
        front |= other.plane.distance_m(v) > 0.0;
        behind |= other.plane.distance_m(v) < 0.0;
      }
      return front == behind ? 0 : front ? 1 : -1;
    };
    for (const Blocker* other : blockers_) {
      if (other == &blocker) continue;
      const Polygon& p = other->polygon;
      for (std::size_t k = 0; k < p.size(); ++k)
        if (same(p[k], b, tolerance) && same(p[(k + 1) % p.size()], a, tolerance))
          return sees(blocker) != 0 && sees(blocker) == sees(*other);
    }
    return false;
  }

  void cut_by_blocker(const Blocker& blocker) {
    const Polygon& p = blocker.polygon;
    const std::size_t n = p.size();
    std::vector<char> inner(n);
    for (std::size_t k = 0; k < n; ++k) inner[k] = is_inner_edge(blocker, p[k], p[(k + 1) % n]);
    const Polygon& s = source_.vertices;
    for (std::size_t k = 0; k < n; ++k) {
      if (!inner[k])
        for (std::size_t l = 0; l < s.size(); ++l)
          shadow_of_edge(s[l], p[k], p[(k + 1) % n], edge_in_plane(s, l, p[k], p[(k + 1) % n]));
      if (inner[k] && inner[(k + n - 1) % n]) continue;
      for (std::size_t l = 0; l < s.size(); ++l)
        source_edge_through(p[k], s[l], s[(l + 1) % s.size()],
                            edge_in_plane(p, k, s[l], s[(l + 1) % s.size()]));
    }
  }

  // Whether an edge at corner k of a polygon lies in the plane of that corner and a-b.
  static bool edge_in_plane(const Polygon& polygon, std::size_t k, const Vec3& a, const Vec3& b) {
    const std::size_t n = polygon.size();
    const Vec3 normal = (a - polygon[k]).cross(b - polygon[k]).normalized();
    for (const std::size_t other : {(k + 1) % n, (k + n - 1) % n})
      if (std::abs(normal.dot((polygon[other] - polygon[k]).normalized())) < kInOnePlane)
        return true;
    return false;
  }

  // Bit 0: some of the receiver sees the front of the plane, bit 1: some sees its back.
  int sides_of(const Plane& plane) const {
    int sides = 0;
    for (const Vec3& v : receiver_.vertices) sides |= plane.distance_m(v) > 0.0 ? 1 : 2;
    return sides;
  }

  void cut_by_solid(const ConvexOccluder& solid) {
    std::vector<int> sides;
    for (const Plane& face : solid.faces) {
      sides.push_back(sides_of(face));
      if (sides.back() == 3) cut_by_plane(face);
    }
    const Polygon& s = source_.vertices;
    const Outline outline = outline_of(solid);
    for (const ConvexOccluder::Edge& edge : outline.edges)
      for (const Vec3& q : s) shadow_of_edge(q, edge.a, edge.b, false);
    for (const Vec3& corner : outline.corners)
      for (std::size_t l = 0; l < s.size(); ++l)
        source_edge_through(corner, s[l], s[(l + 1) % s.size()], false);
  }

  // What may be on the outline of a solid from somewhere on the receiver.
  struct Outline {
    std::vector<ConvexOccluder::Edge> edges;
    std::vector<Vec3> corners;
  };

  Outline outline_of(const ConvexOccluder& solid) const {
    std::vector<int> sides;
    for (const Plane& face : solid.faces) sides.push_back(sides_of(face));
    Outline outline;
    for (const ConvexOccluder::Edge& edge : solid.edges) {
      const int left = sides[edge.left], right = sides[edge.right];
      if (left == right && left != 3) continue;
      outline.edges.push_back(edge);
      outline.corners.push_back(edge.a);
      outline.corners.push_back(edge.b);
    }
    const auto before = [](const Vec3& a, const Vec3& b) {
      return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
    };
    std::sort(outline.corners.begin(), outline.corners.end(), before);
    outline.corners.erase(std::unique(outline.corners.begin(), outline.corners.end()),
                          outline.corners.end());
    return outline;
  }

  void cut_by_two(const ConvexOccluder& near, const ConvexOccluder& far) {
    const Outline before = outline_of(near), behind = outline_of(far);
    for (const Vec3& corner : before.corners)
      for (const ConvexOccluder::Edge& edge : behind.edges)
        if (crosses_source(corner, edge)) source_edge_through(corner, edge.a, edge.b, false);
    for (const Vec3& corner : behind.corners)
      for (const ConvexOccluder::Edge& edge : before.edges)
        if (crosses_source(corner, edge)) shadow_of_edge(corner, edge.a, edge.b, false);
  }

  // Whether the plane of a corner and an edge meets the source at all.
  bool crosses_source(const Vec3& corner, const ConvexOccluder::Edge& edge) const {
    const Vec3 normal = (edge.a - corner).cross(edge.b - corner);
    bool front = false, back = false;
    for (const Vec3& v : source_.vertices) {
      const double height = normal.dot(v - corner);
      front |= height >= 0.0;
      back |= height <= 0.0;
    }
    return front && back;
  }

  // From the source's corner q, edge a-b casts its shadow on the receiver.
  void shadow_of_edge(const Vec3& q, Vec3 a, Vec3 b, bool of_two_edges) {
    const double hq = height(q), top = hq * (1.0 - kBelowSource);
    if (hq <= kOnReceiver * receiver_.radius_m) shadow_along_receiver(q, a, b, of_two_edges);
    if (hq <= 0.0 || !keep_heights(a, b, 0.0, top)) return;
    events_.push_back({projected(q, hq, a), projected(q, hq, b), of_two_edges});
  }

  // A corner in the receiver's own plane, where a wall meets the floor: an edge that stands on the
  // receiver casts its shadow from its foot straight away from there.
  void shadow_along_receiver(const Vec3& q, const Vec3& a, const Vec3& b, bool of_two_edges) {
    const Vec3& foot = height(a) < height(b) ? a : b;
    const double away = (foot - q).norm();
    if (height(foot) > kOnReceiver * receiver_.radius_m || away == 0.0) return;
    const double across = 2.0 * receiver_.radius_m + (receiver_.centroid - foot).norm();
    events_.push_back({foot, foot + across / away * (foot - q), of_two_edges});
  }

  // Edge q-r of the source as the receiver sees it behind the blocker's corner b.
  void source_edge_through(const Vec3& b, Vec3 q, Vec3 r, bool of_two_edges) {
    const double hb = height(b);
    if (hb < 0.0 || !keep_heights(q, r, hb / (1.0 - kBelowSource), HUGE_VAL)) return;
    if (height(q) > 0.0 && height(r) > 0.0)
      events_.push_back({projected(q, height(q), b), projected(r, height(r), b), of_two_edges});
  }

  // Cuts the segment to heights in [low, high]; false if nothing is left.
  bool keep_heights(Vec3& a, Vec3& b, double low, double high) const {
    const double ha = height(a), hb = height(b);
    if (std::max(ha, hb) < low || std::min(ha, hb) > high) return false;
    const Vec3 along = b - a;
    const auto at = [&](double h) { return (h - ha) / (hb - ha); };
    double from = 0.0, to = 1.0;
    for (double limit : {low, high}) {
      const bool a_out = limit == low ? ha < limit : ha > limit;
      const bool b_out = limit == low ? hb < limit : hb > limit;
      if (a_out) from = std::max(from, at(limit));
      if (b_out) to = std::min(to, at(limit));
    }
    b = a + to * along;
    a += from * along;
    return from < to;
  }

  // Where the line from q through b meets the receiver's plane.
  Vec3 projected(const Vec3& q, double height_q, const Vec3& b) const {
    const double hb = std::max(0.0, height(b));
    return b + hb / (height_q - hb) * (b - q);
  }

  const PlanarPolygon& receiver_;
  const PlanarPolygon& source_;
  std::span<const Blocker* const> blockers_;
  std::vector<ViewEvent> events_;
};

class EventCutter {
 public:
  EventCutter(const PlanarPolygon& receiver, std::size_t most_cells)
      : receiver_(receiver),
        most_cells_(most_cells),
        size_(receiver.radius_m),
        cells_{receiver.vertices} {}

  const std::vector<Polygon>& cells() const { return cells_; }

  void cut(const Vec3& from, const Vec3& to) {
    const Vec3 along = to - from;
    const double length = along.norm();
    if (length < 1e-12 * size_) return;
    const Vec3 across = receiver_.plane.normal.cross(along) / length;
    const Plane line{across, across.dot(from)};
    for (std::size_t c = 0, count = cells_.size(); c < count && cells_.size() < most_cells_; ++c) {
      if (!crosses_inside(cells_[c], from, along, length)) continue;
      clip(cells_[c], line, 1e-14 * size_, left_);
      clip(cells_[c], Plane{-line.normal, -line.offset_m}, 1e-14 * size_, right_);
      if (left_.empty() || right_.empty()) continue;
      cells_[c] = left_;
      cells_.push_back(right_);
    }
  }

 private:
  bool crosses_inside(const Polygon& cell, const Vec3& from, const Vec3& along,
                      double length) const {
    double t0 = 0.0, t1 = 1.0;
    for (std::size_t k = 0; k < cell.size(); ++k) {
      const Vec3 inward = receiver_.plane.normal.cross(cell[(k + 1) % cell.size()] - cell[k]);
      const double scale = inward.norm();
      if (scale == 0.0) continue;
      const double start = inward.dot(from - cell[k]) / scale, slope = inward.dot(along) / scale;
      if (std::abs(slope) < 1e-14 * length) {
        if (start <= 1e-13 * size_) return false;
      } else if (slope > 0.0) {
        t0 = std::max(t0, -start / slope);
      } else {
        t1 = std::min(t1, -start / slope);
      }
    }
    return (t1 - t0) * length > 1e-12 * size_;
  }

  const PlanarPolygon& receiver_;
  std::size_t most_cells_;
  double size_;
  std::vector<Polygon> cells_;
  Polygon left_, right_;
};

std::vector<Polygon> cells_between(const PlanarPolygon& receiver,
                                   const std::vector<ViewEvent>& events, std::size_t most_cells) {
  EventCutter cutter(receiver, most_cells);
  for (const ViewEvent& event : events) cutter.cut(event.from, event.to);
  return cutter.cells();
}

}  // namespace

std::vector<ViewEvent> view_events(const PlanarPolygon& receiver, const PlanarPolygon& source,
                                   std::span<const Blocker* const> blockers) {
  return EventFinder(receiver, source).run(blockers);
}

std::vector<Polygon> cells_between_events(const PlanarPolygon& receiver,
                                          const PlanarPolygon& source,
                                          std::span<const Blocker* const> blockers,
                                          std::size_t most_cells) {
  return cells_between(receiver, view_events(receiver, source, blockers), most_cells);
}

std::vector<Polygon> cells_between_events(const PlanarPolygon& receiver,
                                          const PlanarPolygon& source,
                                          std::span<const ConvexOccluder* const> solids,
                                          std::size_t most_cells) {
  return cells_between(receiver, EventFinder(receiver, source).run(solids), most_cells);
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "discontinuity/line_selection.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace truebox {
namespace {

constexpr double kShallow = 0.4;       // sine: 24 degrees
constexpr double kSamplesApart = 3.0;  // a distance apart
constexpr double kShortest = 2.0;      // of a line, in distances apart
constexpr double kTouching = 1e-9;     // of the outline's size
constexpr double kSoonEnough = 2.0;    // to go on, in distances apart, rather than turn aside
constexpr double kTurnsAside = 1.5;    // at most, in distances apart
constexpr double kParallel = 1e-6;     // sine
constexpr int kMostSamples = 4000;

Vec2 nearest_on(const PlaneSegment& s, const Vec2& x) {
  const Vec2 along = s.to - s.from;
  const double t = std::clamp(along.dot(x - s.from) / along.squaredNorm(), 0.0, 1.0);
  return s.from + t * along;
}

class Selection {
 public:
  Selection(const PlanePolygon& outline, double apart_m) : outline_(outline), apart_m_(apart_m) {
    for (std::size_t k = 0; k < outline.size(); ++k) {
      segments_.push_back({outline[k], outline[(k + 1) % outline.size()]});
      size_m_ = std::max(size_m_, (outline[k] - outline[0]).norm());
    }
    outline_count_ = segments_.size();
  }

  void add(const RankedLine& candidate) {
    const auto inside = clipped(candidate.line);
    if (!inside) return;
    if (candidate.must_be)
      segments_.push_back(*inside);
    else
      add_parts_apart(*inside);
  }

  std::vector<PlaneSegment> joined() {
    const std::size_t count = segments_.size();
    for (std::size_t i = outline_count_; i < count; ++i) {
      join(i, segments_[i].from, segments_[i].to);
      join(i, segments_[i].to, segments_[i].from);
    }
    return {segments_.begin() + static_cast<std::ptrdiff_t>(outline_count_), segments_.end()};
  }

 private:
  std::optional<PlaneSegment> clipped(const PlaneSegment& line) const {
    double t0 = 0.0, t1 = 1.0;
    for (std::size_t k = 0; k < outline_count_; ++k) {
      const Vec2 along = segments_[k].direction();
      const double a = cross(along, line.from - segments_[k].from);
      const double b = cross(along, line.to - segments_[k].from);
      const double on_edge = kTouching * size_m_;
      if (a <= on_edge && b <= on_edge) return std::nullopt;
      if (a < 0.0) t0 = std::max(t0, a / (a - b));
      if (b < 0.0) t1 = std::min(t1, a / (a - b));
    }
    const Vec2 along = line.to - line.from;
    if ((t1 - t0) * along.norm() < 1e3 * kTouching * size_m_) return std::nullopt;
    return PlaneSegment{line.from + t0 * along, line.from + t1 * along};
  }

  bool runs_beside_another(const Vec2& x, const Vec2& direction) const {
    return std::any_of(segments_.begin(), segments_.end(), [&](const PlaneSegment& other) {
      return std::abs(cross(direction, other.direction())) < kShallow &&
             (nearest_on(other, x) - x).norm() < apart_m_;
    });
  }

  void add_parts_apart(const PlaneSegment& line) {
    const double length_m = line.length_m();
    const int steps =
        std::clamp(static_cast<int>(kSamplesApart * length_m / apart_m_), 1, kMostSamples);
    const Vec2 direction = line.direction();
    std::vector<PlaneSegment> parts;
    int first = -1;
    for (int i = 0; i <= steps + 1; ++i) {
      const Vec2 x =
          line.from + std::min(1.0, static_cast<double>(i) / steps) * (line.to - line.from);
      const bool is_apart = i <= steps && !runs_beside_another(x, direction);
      if (is_apart && first < 0) first = i;
      if (is_apart || first < 0) continue;
      const auto at = [&](int k) -> Vec2 {
        return line.from + static_cast<double>(k) / steps * (line.to - line.from);
      };
      const PlaneSegment part{at(first), at(i - 1)};
      if (part.length_m() > kShortest * apart_m_) parts.push_back(part);
      first = -1;
    }
    segments_.insert(segments_.end(), parts.begin(), parts.end());
  }

  // Sees to it that the end of segment i lies on another.
  void join(std::size_t i, const Vec2 from, Vec2& end) {
    const Vec2 direction = (end - from).normalized(), at = end;
    double nearest_m = std::numeric_limits<double>::infinity(), ahead_m = nearest_m;
    Vec2 nearest = at;
    for (std::size_t k = 0; k < segments_.size(); ++k) {
      if (k == i || ends_alongside(segments_[k], at, direction)) continue;
      const Vec2 x = nearest_on(segments_[k], at);
      const bool is_own = direction.dot(x - at) < -kTouching * size_m_ &&
                          std::abs(cross(direction, x - at)) < kTouching * size_m_;
      if (!is_own && (x - at).norm() < nearest_m) nearest_m = (x - at).norm(), nearest = x;
      if (const auto hit_m = distance_along(at, direction, segments_[k]))
        ahead_m = std::min(ahead_m, *hit_m);
    }
    if (nearest_m <= kTouching * size_m_) return;
    if (ahead_m > kSoonEnough * apart_m_ && nearest_m < kTurnsAside * apart_m_)
      segments_.push_back({at, nearest});
    else if (std::isfinite(ahead_m))
      end = at + ahead_m * direction;
  }

  // Whether a segment runs along this direction and goes no further than `at`: no line to end on.
  bool ends_alongside(const PlaneSegment& other, const Vec2& at, const Vec2& direction) const {
    return std::abs(cross(direction, other.direction())) < kParallel &&
           std::max(direction.dot(other.from - at), direction.dot(other.to - at)) <=
               kTouching * size_m_;
  }

  std::optional<double> distance_along(const Vec2& at, const Vec2& direction,
                                       const PlaneSegment& other) const {
    const Vec2 along = other.to - other.from;
    const double sine = cross(direction, along);
    if (std::abs(sine) < 1e-9 * along.norm()) return std::nullopt;
    const double t = cross(other.from - at, along) / sine;
    const double share = cross(other.from - at, direction) / sine;
    if (t < 0.0 || share < -1e-9 || share > 1.0 + 1e-9) return std::nullopt;
    return t;
  }

  const PlanePolygon& outline_;
  double apart_m_, size_m_ = 0.0;
  std::vector<PlaneSegment> segments_;  // the outline's edges first
  std::size_t outline_count_ = 0;
};

}  // namespace

std::vector<PlaneSegment> selected_lines(const PlanePolygon& outline, std::vector<RankedLine> lines,
                                         double apart_m) {
  std::stable_sort(lines.begin(), lines.end(), [](const RankedLine& a, const RankedLine& b) {
    return a.must_be != b.must_be ? a.must_be : a.rank > b.rank;
  });
  Selection selection(outline, apart_m);
  for (const RankedLine& line : lines) selection.add(line);
  return selection.joined();
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "scene/polygon.h"

namespace truebox {

/// A convex polygon that may stand in the light, with its plane.
struct Blocker {
  Polygon polygon;
  Plane plane;
};

/// What a blocker hides of a point's view: all behind `near` and behind each side of its pyramid.
struct PointShadow {
  Plane near;
  std::vector<Plane> sides;

  void cast(const Vec3& point, const Blocker& blocker);
  /// Whether it certainly hides nothing, or all, of a convex polygon; within `tolerance_m` neither.
  bool misses(std::span<const Vec3> polygon, double tolerance_m) const;
  bool covers(std::span<const Vec3> polygon, double tolerance_m) const;
};

/// What a point sees of a convex polygon: `source` minus the shadow pyramid of each blocker, as
/// convex parts. Exact to rounding: point-to-polygon factors of the parts carry no sampling noise.
/// Sources: Nishita & Nakamae (1985); Weiler & Atherton (1977).
class VisibleParts {
 public:
  /// The span is valid until the next call.
  std::span<const Polygon> operator()(const Vec3& point, std::span<const Vec3> source,
                                      const Plane& source_plane,
                                      std::span<const Blocker* const> blockers);

 private:
  void remove_shadow(const Vec3& point, const Blocker& blocker);

  std::vector<Polygon> parts_, rest_;
  PointShadow shadow_;
  Polygon outside_, inside_, current_;
};

/// Whether a blocker can come between a point and a polygon at all: it has vertices in front of the
/// polygon, and the two are not on one side of it.
bool may_block(const Blocker& blocker, const Vec3& point, std::span<const Vec3> source,
               const Plane& source_plane, double tolerance_m);

}  // namespace truebox

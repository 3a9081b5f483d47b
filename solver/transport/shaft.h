// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "transport/visible_parts.h"

namespace truebox {

/// What a blocker does to the shaft between two polygons, all segments from one to the other.
enum class ShaftOcclusion {
  none,     ///< no segment meets it (a set without area aside)
  partial,  ///< some may; the test is conservative on this side
  full,     ///< every segment does: the two do not see each other
};

/// A blocker with the planes through its edges, for many shafts.
struct ShaftBlocker {
  Blocker blocker;
  std::vector<Plane> edges;  ///< normal to the blocker, pointing outward

  explicit ShaftBlocker(Blocker convex);
};

/// One convex blocker against the shaft of two convex polygons. The points where segments cross the
/// blocker's plane lie in the convex hull of those of the vertices (the crossing is a projective
/// map of each end), so vertices decide: all outside one edge, none; all inside, full.
/// Planes are those of the polygons; `tolerance_m` counts as on the plane.
/// Sources: Haines & Wallace (1994), shaft culling; Cohen-Or et al. (1998), convex occluders.
ShaftOcclusion shaft_occlusion(std::span<const Vec3> a, const Plane& plane_a,
                               std::span<const Vec3> b, const Plane& plane_b,
                               const ShaftBlocker& blocker, double tolerance_m);
ShaftOcclusion shaft_occlusion(std::span<const Vec3> a, const Plane& plane_a,
                               std::span<const Vec3> b, const Plane& plane_b,
                               const Blocker& blocker, double tolerance_m);

}  // namespace truebox

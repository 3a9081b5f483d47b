// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "transport/convex_occluder.h"
#include "transport/form_factor.h"

namespace truebox {

/// Shadows of solids on one small source, seen from eight points at a time: nothing is cut into
/// polygons. A convex region's area and centroid are sums over its boundary, and each edge of the
/// source, or line of a shadow, adds the part of it that lies in the region, an interval.
inline constexpr std::size_t kShadowLanes = 8;

/// Eight points of one patch.
struct LanePoints {
  alignas(64) std::array<double, kShadowLanes> x, y, z;
  alignas(64) std::array<double, kShadowLanes> weight_m2;  ///< 0: a lane without a point
};

/// As ShadowCone, from eight points: a plane that one point lacks has everything behind it there.
struct LaneShadow {
  static constexpr int kMostPlanes = 24;
  using Planes = std::array<std::array<double, kShadowLanes>, kMostPlanes>;

  alignas(64) Planes x, y, z, offset_m;
  int count = 0;
  std::uint32_t hides_all = 0;  ///< bit l: whatever the source, from point l

  /// False if the planes are too many. `normal`: of the patch of the points.
  bool make(const LanePoints& points, const Vec3& normal, const ConvexOccluder& solid,
            double tolerance_m);
};

/// A polygon of up to eight corners in its own plane, coordinates about its centroid. The last
/// corner is repeated: a triangle has four, a pentagon eight.
struct FlatSource {
  static constexpr std::size_t kMostCorners = 8;

  Vec3 u, v;  ///< axes, unit
  std::array<double, kMostCorners> corner_u, corner_v;
  std::size_t corners = 4;  ///< or kMostCorners

  static bool fits(const PlanarPolygon& polygon) {
    return polygon.vertices.size() <= kMostCorners;
  }
  explicit FlatSource(const PlanarPolygon& polygon);
};

/// Kernel between points and source, and what of it is hidden.
struct LaneShares {
  alignas(64) std::array<double, kShadowLanes> kernel_m2;  ///< weight cos cos / r^4 of the whole
  alignas(64) std::array<double, kShadowLanes> hidden;     ///< in [0, 1], exactly 0 for nothing
};

/// Of a source wholly above the points' horizon and far from them, kernels at centroids as
/// ShadowParts::hidden_share; at most two shadows overlap on it. False if there are more, or if too
/// many of their planes cut the source.
bool hidden_shares(const LanePoints& points, const Vec3& normal, const PlanarPolygon& source,
                   const FlatSource& flat, std::span<const LaneShadow* const> shadows,
                   LaneShares& shares);

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include "transport/shaft.h"

namespace truebox {

/// A convex solid that lets no light through: the faces of a block together, or one convex polygon
/// as a solid without thickness, whose rim counts as faces. One solid hides what no single face
/// does, and its outline has no inner edges.
struct ConvexOccluder {
  struct Edge {
    Vec3 a, b;                  ///< a to b runs counter-clockwise about `left`, seen from outside
    std::uint32_t left, right;  ///< into faces
  };

  std::vector<Plane> faces;  ///< normals outward, unit
  std::vector<Edge> edges;
  std::vector<Vec3> corners;
  std::vector<std::uint32_t> members;  ///< the polygons it is made of
  Eigen::AlignedBox3d box;
};

/// Groups polygons into solids: those that share all edges and bound a convex body, at most one of
/// its faces missing (any segment through the body meets two of them), at most 16 faces. Other
/// polygons stay alone. Corners are shared where their coordinates are equal.
std::vector<ConvexOccluder> convex_occluders(std::span<const Blocker> polygons, double tolerance_m);

/// One end of many shafts: a polygon with its plane, measured against one solid.
struct MeasuredEnd {
  std::size_t corners = 0;
  bool sees_solid = false;  ///< the solid has corners in front of the plane
  std::uint32_t front = 0;  ///< bit f: no corner lies behind face f
  /// Heights of all corners over face 0, face 1, ...; then, for each edge of the solid, the planes
  /// between those of its two faces (0: left, 1: right) that have all corners in front: from, to.
  std::vector<double> values;

  /// At most 16 corners and 17 faces, else no shaft is decided: `corners` is 0 then.
  void measure(std::span<const Vec3> polygon, const Plane& plane, const ConvexOccluder& occluder,
               double tolerance_m);
};

/// As the shaft test of one polygon. All segments are hidden if those between the corners are: what
/// a solid hides from a point is convex. None is if a plane through one of its edges keeps it
/// apart.
ShaftOcclusion shaft_occlusion(std::span<const Vec3> a, const Plane& plane_a,
                               std::span<const Vec3> b, const Plane& plane_b,
                               const ConvexOccluder& occluder, double tolerance_m);
ShaftOcclusion shaft_occlusion(const MeasuredEnd& a, const MeasuredEnd& b,
                               const ConvexOccluder& occluder, double tolerance_m);

}  // namespace truebox

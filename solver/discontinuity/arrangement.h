// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "discontinuity/plane_frame.h"

namespace truebox {

using PlanePolygon = std::vector<Vec2>;  ///< counter-clockwise, m

/// Convex triangles and quads that cover a polygon, none of them crossed by a segment: the faces
/// between the segments, those that are well-shaped quads or triangles as they are, the others by a
/// constrained Delaunay triangulation whose triangles are paired to quads where these are well
/// shaped. A segment that ends inside a face is dropped (see selected_lines). Corners are moved by
/// less than `snap_m` so that nearly equal ones become one.
/// std::runtime_error if the geometry engine gives up. Source: Chew (1989).
std::vector<PlanePolygon> cells_between_lines(const PlanePolygon& outline,
                                              const std::vector<PlaneSegment>& segments,
                                              double snap_m);

}  // namespace truebox

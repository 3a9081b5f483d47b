// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "discontinuity/arrangement.h"

namespace truebox {

/// A line that a mesh may follow.
struct RankedLine {
  PlaneSegment line;
  double rank = 0.0;     ///< the higher, the sooner taken
  bool must_be = false;  ///< taken whole, however close to others
};

/// Segments that divide a convex polygon without slivers: lines in the order of their rank, without
/// the parts that run beside one already taken or an edge, closer than `apart_m` and at less than
/// 24 degrees. What then ends inside a face goes on to the next segment, so that all bound faces.
std::vector<PlaneSegment> selected_lines(const PlanePolygon& outline, std::vector<RankedLine> lines,
                                         double apart_m);

}  // namespace truebox

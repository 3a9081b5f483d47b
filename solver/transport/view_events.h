// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <span>
#include <vector>

#include "transport/convex_occluder.h"
#include "transport/form_factor.h"
#include "transport/visible_parts.h"

namespace truebox {

/// The trace of a visual event on the receiver's plane, m, over which the view of a source changes
/// its kind. It may leave the receiver.
struct ViewEvent {
  Vec3 from = Vec3::Zero(), to = Vec3::Zero();
  /// An edge of the source and one of the blocker lie in one plane through the trace: what is seen
  /// of the source grows in proportion to the distance from it, elsewhere like its square.
  bool of_two_edges = false;
};

/// The shadow outlines that blockers cast from corners of the source, the outlines of the source
/// seen through corners of blockers, and the blockers' planes. Not: triples of edges (EEE), which
/// are curves.
/// Source: Heckbert (1992), Lischinski et al. (1992), vertex-edge events.
std::vector<ViewEvent> view_events(const PlanarPolygon& receiver, const PlanarPolygon& source,
                                   std::span<const Blocker* const> blockers);

/// Cuts the receiver into convex cells along view_events: within a cell the visible part of the
/// source changes smoothly, except where outlines of two blockers cross. At most `most_cells`;
/// lines beyond that are left out.
std::vector<Polygon> cells_between_events(const PlanarPolygon& receiver,
                                          const PlanarPolygon& source,
                                          std::span<const Blocker* const> blockers,
                                          std::size_t most_cells);
std::vector<Polygon> cells_between_events(const PlanarPolygon& receiver,
                                          const PlanarPolygon& source,
                                          std::span<const ConvexOccluder* const> solids,
                                          std::size_t most_cells);

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <span>
#include <vector>

#include "transport/convex_occluder.h"
#include "transport/form_factor.h"
#include "transport/visible_parts.h"

namespace truebox {

/// Cuts the receiver into convex cells along the traces of its visual events with the source: the
/// shadow outlines that blockers cast from corners of the source, the outlines of the source seen
/// through corners of blockers, and the blockers' planes. Within a cell the visible part of the
/// source changes smoothly, except where outlines of two blockers cross.
/// At most `most_cells`; lines beyond that are left out.
/// Source: Heckbert (1992), Lischinski et al. (1992), vertex-edge events.
std::vector<Polygon> cells_between_events(const PlanarPolygon& receiver,
                                          const PlanarPolygon& source,
                                          std::span<const Blocker* const> blockers,
                                          std::size_t most_cells);
std::vector<Polygon> cells_between_events(const PlanarPolygon& receiver,
                                          const PlanarPolygon& source,
                                          std::span<const ConvexOccluder* const> solids,
                                          std::size_t most_cells);

}  // namespace truebox

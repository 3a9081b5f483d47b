// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "transport/gather.h"
#include "transport/shaft_culling.h"

namespace truebox {

/// A segment on a piece of surface across which its irradiance or a derivative of it jumps.
struct DiscontinuityLine {
  Vec3 from = Vec3::Zero(), to = Vec3::Zero();
  int order = 0;  ///< of the lowest derivative that jumps: D0, D1, D2
  /// How far off an element of the width looked at is across the line, more than the smooth light
  /// on either side would make it: largest difference of second differences of the direct
  /// irradiance, relative to `LineOptions::unit`. Infinite for D0: always followed.
  double strength = 0.0;
};

struct LineOptions {
  double width_m = 0.0;  ///< of an element: differences are taken over half of it
  double unit = 1.0;     ///< W m^-2 nm^-1, summed over bands: what strength is relative to
  double least_strength = 0.0;
};

/// All lines of one piece: D0 where another surface touches it (contact_lines); of every luminaire
/// and what may hide a part of it, the lines at which a corner or an edge of the luminaire comes
/// out behind an edge or a corner of a blocker (view_events), D1 where two edges lie in one plane
/// and D2 elsewhere; and D1 where the piece runs through the plane of a luminaire. Each is cut to
/// the part where it is stronger than asked for; the others are left out.
/// Not found: the curves that three edges make (EEE), and lines of reflected light.
/// Sources: Heckbert (1992); Lischinski, Tampieri & Greenberg (1992).
std::vector<DiscontinuityLine> discontinuity_lines(const Scene& scene, const PatchMesh& mesh,
                                                   std::uint32_t piece, const Gather& gather,
                                                   const ShaftCulling& culling,
                                                   const LineOptions& options);

}  // namespace truebox

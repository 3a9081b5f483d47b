// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>

#include "transport/bounded_exchange.h"
#include "transport/convex_occluder.h"
#include "transport/visible_parts.h"

namespace truebox {

struct ExactVisibilityOptions {
  double relative_tolerance = 1e-9;          ///< of the visible exchange area
  std::size_t most_evaluations = 2'000'000;  ///< points of the receiver; then the bound says so
  int nusselt_arcs =
      0;  ///< above 0: nusselt_factor with as many chords in place of Lambert's formula
  double absolute_tolerance_m2 = 0.0;  ///< suffices, too
};

struct VisibleExchange {
  double exchange_area_m2 = 0.0;
  double error_bound_m2 = 0.0;
  std::size_t evaluations = 0;
  bool converged = false;  ///< the bound is within the tolerance
};

/// Exchange area A_i F_ij of two convex polygons with blockers between them, without noise: from
/// each quadrature point the source is clipped by the blockers' projections, then Lambert's
/// formula. The receiver is first cut along the lines where the view changes its kind (a corner of
/// the source behind an edge of a blocker, or the reverse), so that each cell sees a smooth
/// integrand; what is left (crossings of two blockers' edges, touching polygons) is found by
/// bisection of the worst cell across its rougher direction. Mostly visible pairs integrate what is
/// hidden and subtract it from the closed form.
///
/// The error bound sums |Q5 - Q3| (or |Q3 - Q2|) of tensor Gauss rules over all cells, the
/// difference that the better rule removes, and adds rounding, in proportion to the terms of
/// Lambert's sum: where the planes are nearly one, they cancel.
/// Sources: Nishita & Nakamae (1985); Heckbert (1992), Drettakis & Fiume (1994) for the lines;
/// Berntsen, Espelid, Genz (1991) for adaptive cubature.
VisibleExchange visible_exchange(const PlanarPolygon& i, const PlanarPolygon& j,
                                 std::span<const Blocker* const> blockers,
                                 const ExactVisibilityOptions& options);

/// The same behind convex solids, several times as fast. Nothing if the parts of the source become
/// too many for the memory of ShadowParts, or the planes of a solid.
std::optional<VisibleExchange> visible_exchange(const PlanarPolygon& receiver,
                                                const PlanarPolygon& source,
                                                std::span<const ConvexOccluder* const> solids,
                                                const ExactVisibilityOptions& options);

}  // namespace truebox

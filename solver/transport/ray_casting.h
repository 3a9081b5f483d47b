// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>

#include "transport/form_factor.h"
#include "transport/visible_parts.h"

namespace truebox {

/// Visible share of a pair and its standard error (k = 1).
struct VisibleShare {
  double share = 1.0;
  double standard_error = 0.0;
};

/// A point of a convex polygon, uniform for uniform (u, v) in the unit square.
Vec3 sample_polygon(std::span<const Vec3> polygon, double u, double v);

/// Kernel-weighted share of `rays` segments between two polygons that no blocker meets,
/// sum w V / sum w with w = cos_i cos_j / r^4, ends from a scrambled Sobol' sequence in four
/// dimensions (take a power of two).
/// The analytic kernel times this share is the exchange area. Segments are tested in double
/// precision against blockers that are neither of the two: no ray offset is needed.
/// The standard error is that of independent rays with two rays added to either outcome (so that it
/// is not 0 where all agree by chance); evenly spread rays do better. rays >= 1.
/// Sources: Joe & Kuo (2008), Burley (2020) for the sequence; Agresti & Coull (1998) for the added
/// rays.
VisibleShare visible_share(const PlanarPolygon& i, const PlanarPolygon& j,
                           std::span<const Blocker* const> blockers, int rays, std::uint64_t seed);

}  // namespace truebox

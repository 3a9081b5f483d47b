// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "transport/form_factor.h"

namespace truebox {

/// View factor from a surface element to a convex polygon in front of which it lies, as
/// point_to_polygon, where the two nearly share a plane: Lambert's terms are then of order 1 and
/// their sum is of the order of the tilt squared. With m the polygon's normal, h the height of the
/// point over its plane and t = n - (n . m) m,
///   F = -(n . m) C + T,   C = 1/pi int h^2 / r^4 dA,   T = 1/pi int h (t . r) / r^4 dA.
/// Both are sums over edges; from each term of C the same term at h = 0 is taken away in closed
/// form, and all of these together are known: 2 pi if the point's foot lies in the polygon, else 0.
/// The whole polygon is above the element's horizon. Both m^2 / m^2. Source: Lambert's sum (1760),
/// its terms of the coplanar case taken away before they cancel; derived here, held to certified
/// values in reference/analytic/view_factors.csv.
double grazing_factor(const Vec3& point, const Vec3& normal, const PlanarPolygon& source);

/// Exchange area (m^2) of two convex polygons wholly in front of each other that nearly share a
/// plane: grazing_factor integrated over the receiver, cells cut in four where two Gauss rules
/// differ (touching corners, mostly), to a relative tolerance of 1e-12 to 1e-2.
double grazing_exchange_m2(const PlanarPolygon& receiver, const PlanarPolygon& source,
                           double relative_tolerance);

/// The largest height of either over the other's plane, in units of their distance and size: 0 in
/// one plane. Rounding of planes makes exchange areas wrong by some epsilons over this, relative.
double relative_height(const PlanarPolygon& i, const PlanarPolygon& j);

}  // namespace truebox

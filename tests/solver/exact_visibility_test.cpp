// SPDX-License-Identifier: BSD-3-Clause
#include "transport/exact_visibility.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace truebox {
namespace {

// A floor, and beside it a plate that rises with `tilt` from 0.2 m away for `length_m`.
const Polygon kFloor = {{-1, 0, 0}, {0, 0, 0}, {0, 1, 0}, {-1, 1, 0}};

PlanarPolygon plate(double tilt, double length_m) {
  const double x = 0.2 + length_m * std::cos(tilt), z = length_m * std::sin(tilt);
  return PlanarPolygon({{0.2, 0, 0}, {x, 0, z}, {x, 1, z}, {0.2, 1, 0}});
}

// A wall across the plate hides all that is beyond it from all of the floor: what is left is the
// nearer half, whose unoccluded exchange does not cancel (grazing_exchange).
TEST(VisibleExchange, BoundHoldsWherePlanesAreNearlyOneAndLambertsTermsCancel) {
  const PlanarPolygon floor(kFloor);
  const Polygon wall = {{0.7, -5, -1}, {0.7, 5, -1}, {0.7, 5, 5}, {0.7, -5, 5}};
  const Blocker blocker{wall, plane_of(wall)};
  const std::vector<const Blocker*> blockers = {&blocker};
  for (int k = 10; k <= 60; ++k) {
    const double tilt = std::pow(10.0, -0.1 * k);
    const VisibleExchange found = visible_exchange(floor, plate(tilt, 1.0), blockers, {});
    const double nearer = exchange_area_m2(floor, plate(tilt, 0.5 / std::cos(tilt)), 1e-12);
    // Coordinates of the plate round: some epsilons over the tilt.
    const double coordinates = 1e-15 / tilt * nearer;
    EXPECT_NEAR(found.exchange_area_m2, nearer, found.error_bound_m2 + coordinates) << tilt;
    // Worth something while the sum does: no more than some hundred epsilons of an area of 1 m^2.
    EXPECT_LT(found.error_bound_m2, 1e-9 * nearer + 5e-14) << tilt;
  }
}

}  // namespace
}  // namespace truebox

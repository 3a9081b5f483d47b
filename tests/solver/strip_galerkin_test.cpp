// SPDX-License-Identifier: BSD-3-Clause
#include "transport/strip_galerkin.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "transport/legendre.h"
#include "transport/quadrature.h"

namespace truebox {
namespace {

TEST(Legendre, IsOrthonormal) {
  // 16 Gauss points integrate the products to degree 31.
  const GaussRule& rule = gauss_rule(16);
  double phi[16][kMaxDegree + 1];
  for (int q = 0; q < 16; ++q) legendre(rule.nodes[q], kMaxDegree, phi[q]);
  for (int k = 0; k <= kMaxDegree; ++k)
    for (int l = 0; l <= kMaxDegree; ++l) {
      double sum = 0.0;
      for (int q = 0; q < 16; ++q) sum += rule.weights[q] * phi[q][k] * phi[q][l];
      EXPECT_NEAR(sum, k == l, 1e-12) << k << " " << l;  // some hundred roundings
    }
}

// The section of a duct, lit sides inwards: a closed enclosure.
std::vector<Strip> duct(double scale) {
  const Eigen::Vector2d a(0.0, 0.0), b(4.0 * scale, 0.0), c(0.0, 3.0 * scale);
  return {{a, b}, {b, c}, {c, a}};
}

TEST(StripEnclosure, ReproducesTheFurnaceOfATriangularDuct) {
  // rho and E equal everywhere, closed: B = E / (1 - rho), whatever the section and its scale.
  for (const double scale : {1e-6, 1.0, 1e6}) {
    StripOptions options;
    options.degree = 3;
    options.finest = 1e-6;
    const StripEnclosure enclosure(duct(scale), options);
    for (const double rho : {0.0, 0.5, 0.99}) {
      const StripSolution b = enclosure.solve({rho, rho, rho}, {2.0, 2.0, 2.0});
      for (std::size_t s = 0; s < 3; ++s)
        for (const double t : {0.0, 0.3, 1.0})
          EXPECT_LE(std::abs(b.radiosity(s, t) - 2.0 / (1.0 - rho)), b.error_bound(s, t))
              << rho << " " << s << " " << t;
      // In the corner two walls fill the view only in the limit: the shortest element decides.
      EXPECT_LT(b.mean_error_bound(0), 1e-3 / (1.0 - rho));
    }
  }
}

TEST(StripEnclosure, HasTheViewFactorOfCrossedStrings) {
  // Only the hypotenuse shines, nothing reflects but the side of 3: one bounce. Hottel: from 3 to
  // 5 of a 3-4-5 duct (3 + 5 - 4) / (2 * 3) = 2/3.
  const double rho = 0.5;
  StripOptions options;
  options.degree = 3;
  options.finest = 1e-6;
  const StripEnclosure enclosure(duct(1.0), options);
  const StripSolution b = enclosure.solve({0.0, 0.0, rho}, {0.0, 1.0, 0.0});
  EXPECT_LE(std::abs(b.mean_radiosity(2) - rho * 2.0 / 3.0), b.mean_error_bound(2));
  // Unresolved is the shortest element's factor, 1e-6 of the side.
  EXPECT_NEAR(b.mean_radiosity(2), rho * 2.0 / 3.0, 1e-6);
}

TEST(StripEnclosure, BoundHoldsAtEveryDegreeAndShrinksWithIt) {
  const auto plates = [](int degree) {
    StripOptions options;
    options.degree = degree;
    return StripEnclosure({{{0.0, 0.0}, {1.0, 0.0}}, {{1.0, 0.3}, {0.0, 0.3}}}, options);
  };
  const StripEnclosure fine_plates = plates(15);
  const StripSolution fine = fine_plates.solve({0.9, 0.6}, {1.0, 0.0});
  double before = 1.0;
  for (int degree = 0; degree <= 6; ++degree) {
    const StripEnclosure coarse_plates = plates(degree);
    const StripSolution coarse = coarse_plates.solve({0.9, 0.6}, {1.0, 0.0});
    double worst = 0.0;
    for (std::size_t s = 0; s < 2; ++s)
      for (int k = 0; k <= 100; ++k) {
        const double t = k / 100.0;
        const double error = std::abs(coarse.radiosity(s, t) - fine.radiosity(s, t));
        EXPECT_LE(error, coarse.error_bound(s, t) + fine.error_bound(s, t)) << degree << " " << t;
        worst = std::max(worst, error);
      }
    // A bound more than some ten times too wide would say little.
    EXPECT_LT(coarse.error_bound(0, 0.5), 30.0 * worst) << degree;
    EXPECT_LT(worst, degree ? 0.5 * before : 1.0) << degree;
    before = worst;
  }
}

TEST(StripEnclosure, RefusesWhatItCannotSolve) {
  const std::vector<Strip> plates = {{{0.0, 0.0}, {1.0, 0.0}}, {{1.0, 1.0}, {0.0, 1.0}}};
  EXPECT_THROW(StripEnclosure({{{0.0, 0.0}, {0.0, 0.0}}}, {}), std::invalid_argument);
  EXPECT_THROW(StripEnclosure({{{0.0, 0.0}, {1.0, 0.0}}, {{0.5, -1.0}, {0.5, 1.0}}}, {}),
               std::invalid_argument);
  StripOptions options;
  options.degree = 16;
  EXPECT_THROW(StripEnclosure(plates, options), std::invalid_argument);
  const StripEnclosure enclosure(plates, {});
  EXPECT_THROW(enclosure.solve({1.0, 0.5}, {1.0, 1.0}), std::invalid_argument);
  EXPECT_THROW(enclosure.solve({0.5}, {1.0, 1.0}), std::invalid_argument);
  EXPECT_THROW(enclosure.solve({0.5, 0.5}, {1.0, std::nan("")}), std::invalid_argument);
}

}  // namespace
}  // namespace truebox

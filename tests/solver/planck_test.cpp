// SPDX-License-Identifier: BSD-3-Clause
#include "radiometry/planck.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <stdexcept>

namespace truebox {
namespace {

TEST(Planck, StefanBoltzmannConstantIsThePublishedOne) {
  EXPECT_NEAR(stefan_boltzmann_constant(), 5.670374419e-8, 5e-18);  // CODATA 2018, all its digits
}

TEST(Planck, SumsToStefanBoltzmann) {
  for (const double kelvin : {3.0, 300.0, 3000.0, 6000.0}) {
    // 200 to 3e7 um K: what lies outside is 6e-12 of the whole.
    double sum = 0.0;
    const double from = 200e3 / kelvin, to = 3e10 / kelvin;
    const int bands = 400;
    for (int k = 0; k < bands; ++k) {
      const double a = from * std::pow(to / from, static_cast<double>(k) / bands);
      const double b = from * std::pow(to / from, static_cast<double>(k + 1) / bands);
      sum += (b - a) * mean_planck_exitance(a, b, kelvin);
    }
    EXPECT_NEAR(sum / blackbody_exitance(kelvin), 1.0, 1e-11) << kelvin;
  }
}

TEST(Planck, BandFractionsAreThoseOfTheTables) {
  // Fraction of sigma T^4 below lambda T, um K. Incropera et al. (2007), table 12.1.
  const double table[][2] = {
      {1000, 0.000321}, {2000, 0.066728}, {4000, 0.480877}, {6000, 0.737818}, {10000, 0.914199}};
  for (const auto& [lambda_T, fraction] : table) {
    const double kelvin = 1000.0, to_nm = lambda_T;  // um K at 1000 K: lambda in nm
    EXPECT_NEAR(
        (to_nm - 150.0) * mean_planck_exitance(150.0, to_nm, kelvin) / blackbody_exitance(kelvin),
        fraction, 6e-7 + 7e-5 * fraction)  // it divides by sigma = 5.670e-8: 6.6e-5
        << lambda_T;
  }
}

TEST(Planck, PeaksWhereWienSays) {
  const double peak_nm = 2897771.955 / 300.0;  // Wien's constant, CODATA 2018, nm K
  const double at = planck_exitance(peak_nm, 300.0);
  EXPECT_GT(at, planck_exitance(peak_nm * 1.001, 300.0));
  EXPECT_GT(at, planck_exitance(peak_nm / 1.001, 300.0));
}

TEST(Planck, HoldsAtTheExtremes) {
  EXPECT_EQ(planck_exitance(500.0, 0.0), 0.0);
  EXPECT_EQ(mean_planck_exitance(400.0, 700.0, 0.0), 0.0);
  EXPECT_EQ(mean_planck_exitance(400.0, 700.0, 1.0), 0.0);  // exp(-2e4): below the smallest double
  // Rayleigh-Jeans: M = 2 pi c k T / lambda^4 where lambda T is large; x = 1.4e-5 corrects by x/2.
  const double metre = 1e9, kelvin = 1000.0;
  const double jeans = 1e-9 * 2.0 * M_PI * 299792458.0 * 1.380649e-23 * kelvin;
  EXPECT_NEAR(planck_exitance(metre, kelvin) / jeans, 1.0, 1e-5);
  for (const double bad :
       {-1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW(planck_exitance(bad, 300.0), std::invalid_argument);
    EXPECT_THROW(planck_exitance(500.0, bad), std::invalid_argument);
    EXPECT_THROW(mean_planck_exitance(500.0, bad, 300.0), std::invalid_argument);
  }
  EXPECT_THROW(mean_planck_exitance(500.0, 400.0, 300.0), std::invalid_argument);
}

}  // namespace
}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "sensor/spectral_responsivity.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "support/tiny_scenes.h"

namespace truebox {
namespace {

constexpr double kPlanck = 6.62607015e-34, kLight = 299792458.0, kBoltzmann = 1.380649e-23;

TabulatedSpectrum flat(double value) { return TabulatedSpectrum({550.0}, {value}); }

WavelengthGrid one_band(double from_nm, double to_nm) {
  return WavelengthGrid::uniform(0.5 * (from_nm + to_nm), 0.5 * (from_nm + to_nm), to_nm - from_nm);
}

TEST(SpectralResponsivity, CountsThePhotonsOfALine) {
  // A mercury line 0.02 nm wide at its foot; the filter's edge crosses the band. A line's photons
  // see the filter at the line: 0.2 there, where the band's mean is 0.5.
  const double line_nm = 546.07;
  const TabulatedSpectrum lamp({line_nm - 0.01, line_nm, line_nm + 0.01}, {0.0, 100.0, 0.0});
  const TabulatedSpectrum filter({540.0, 544.07, 548.07, 560.0}, {0.0, 0.0, 0.4, 1.0});
  const auto bands = one_band(540.0, 560.0);
  const auto weights = band_responsivity({filter, flat(0.5)}, bands, lamp);
  const double expected = 20.0 * 0.2 * 0.5 * line_nm * 1e-9 / (kPlanck * kLight);
  // The line is symmetric: what remains is its second moment, (0.01 nm)^2 / 6, times d eta / d nm
  // over the wavelength: 1e-7 of the result.
  EXPECT_NEAR(weights[0] / expected, 1.0, 1e-6);
}

TEST(SpectralResponsivity, CountsThePhotonsOfABlackBody) {
  // All wavelengths in one band: energy sigma T^4 / pi and photons 4 zeta(3) c (k T / (h c))^3,
  // both per steradian (Planck's law, integrated).
  const double kelvin = 2856.0, zeta3 = 1.2020569031595942;
  std::vector<double> nm, radiance;
  for (double l = 100.0; l < 4e6; l *= 1.0005) {
    nm.push_back(l);
    const double metre = l * 1e-9;
    radiance.push_back(1e-9 * 2.0 * kPlanck * kLight * kLight / std::pow(metre, 5) /
                       std::expm1(kPlanck * kLight / (metre * kBoltzmann * kelvin)));
  }
  const auto bands = one_band(nm.front(), nm.back());
  const TabulatedSpectrum planck(nm, radiance);
  const double mean = planck.band_mean(bands.centre_nm(0), bands.width_nm(0));
  const double energy = 2.0 * std::pow(std::numbers::pi, 4) * std::pow(kBoltzmann * kelvin, 4) /
                        (15.0 * std::pow(kPlanck, 3) * kLight * kLight);
  const double photons =
      4.0 * zeta3 * kLight * std::pow(kBoltzmann * kelvin / (kPlanck * kLight), 3);
  // The table's straight lines are (d ln l)^2 / 12 x curvature off: 4e-7; the tail that is cut
  // beyond 4 mm has 1 / (4 zeta(3) (l k T / (h c))^2) = 3.3e-7 of the photons (Rayleigh, Jeans).
  EXPECT_NEAR(mean * bands.width_nm(0) / energy, 1.0, 2e-6);
  EXPECT_NEAR(mean * band_responsivity({}, bands, planck)[0] / photons, 1.0, 2e-6);
}

TEST(SpectralResponsivity, IsExactForProductsOfStraightLines) {
  // eta = a^3 with a = (l - 400) / 200, lamp = (600 - l) / 200: int over 400..600 by hand, with
  // u = a: int u^3 (1 - u) (400 + 200 u) du / int (1 - u) du
  //      = (400 (1/4 - 1/5) + 200 (1/5 - 1/6)) / (1/2).
  const TabulatedSpectrum rising({400.0, 600.0}, {0.0, 1.0}), lamp({400.0, 600.0}, {1.0, 0.0});
  const auto weights = band_responsivity({rising, rising, rising}, one_band(400.0, 600.0), lamp);
  const double expected = 200.0 * (400.0 * 0.05 + 200.0 / 30.0) * 2.0 * 1e-9 / (kPlanck * kLight);
  EXPECT_NEAR(weights[0] / expected, 1.0, 1e-14);
}

TEST(SpectralResponsivity, TakesAFlatSpectrumWhereTheLampIsDark) {
  const TabulatedSpectrum lamp({400.0, 499.0, 500.0, 600.0}, {1.0, 1.0, 0.0, 0.0});
  const auto bands = WavelengthGrid::from_centres({450.0, 550.0});
  const auto weights = band_responsivity({flat(0.3)}, bands, lamp);
  EXPECT_NEAR(weights[1] / (100.0 * 0.3 * 550e-9 / (kPlanck * kLight)), 1.0, 1e-14);
  EXPECT_THROW(band_responsivity({}, bands, flat(-1.0)), std::invalid_argument);
}

TEST(SpectralResponsivity, WeighsLampsByTheirPower) {
  Scene scene = tiny::grey_scene(0.5, 1.0);
  scene.materials[0].exitance_spectrum = TabulatedSpectrum({400.0, 700.0}, {1.0, 0.0});
  scene.materials.push_back(scene.materials[0]);
  scene.materials[1].exitance_spectrum = TabulatedSpectrum({500.0, 501.0}, {-1.0, 2.0});
  tiny::add_surface(scene, "3 m2", {{0, 0, 0}, {3, 0, 0}, {3, 1, 0}, {0, 1, 0}});
  tiny::add_surface(scene, "1 m2", {{0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}}, 1);
  const TabulatedSpectrum sum = luminaire_spectrum(scene);
  EXPECT_NEAR(sum.at(400.0), 3.0, 1e-14) << "the second is negative there, and taken as dark";
  EXPECT_NEAR(sum.at(700.0), 2.0, 1e-14);
  EXPECT_EQ(luminaire_spectrum(tiny::grey_scene(0.5)).at(500.0), 1.0) << "nothing emits: flat";
}

TEST(SampleBands, KeepALinesPower) {
  // A line tabulated finely in a table that is coarse elsewhere; bands of 20 nm.
  const TabulatedSpectrum lamp({400.0, 545.0, 546.0, 547.0, 700.0}, {0.0, 0.0, 50.0, 0.0, 0.0});
  const auto bands = WavelengthGrid::uniform(410.0, 690.0, 20.0);
  double power = 0.0;
  const auto values = sample_bands(lamp, bands);
  for (std::size_t b = 0; b < bands.size(); ++b) power += values[b] * bands.width_nm(b);
  EXPECT_NEAR(power, 50.0, 1e-12) << "W m^-2: half the base times the height";
}

}  // namespace
}  // namespace truebox

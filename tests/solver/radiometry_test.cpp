// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "radiometry/observer.h"
#include "radiometry/spectral.h"
#include "radiometry/table_file.h"

namespace truebox {
namespace {

using testing::ElementsAre;

constexpr double kRounding = 1e-13;  // relative: a handful of operations
const double kNaN = std::numeric_limits<double>::quiet_NaN();

TEST(WavelengthGrid, CountsBothEnds) {
  const WavelengthGrid grid = WavelengthGrid::uniform(400, 700, 4);
  ASSERT_EQ(grid.size(), 76u);
  EXPECT_NEAR(grid.centre_nm(75), 700.0, 700 * kRounding);
  EXPECT_EQ(grid.width_nm(3), 4.0);
}

TEST(WavelengthGrid, BandsReachHalfWayToTheirNeighbours) {
  const WavelengthGrid grid = WavelengthGrid::from_centres({400, 410, 440});
  EXPECT_NEAR(grid.width_nm(1), 20.0, 20 * kRounding);
}

TEST(WavelengthGrid, RefusesWhatIsNoGrid) {
  EXPECT_THROW(WavelengthGrid::from_centres({500, 400}), std::invalid_argument);
  EXPECT_THROW(WavelengthGrid::from_centres({500, 500}), std::invalid_argument);
  EXPECT_THROW(WavelengthGrid::from_centres({-1.0}), std::invalid_argument);
  EXPECT_THROW(WavelengthGrid::from_centres({kNaN}), std::invalid_argument);
  EXPECT_THROW(WavelengthGrid::uniform(400, 700, 0), std::invalid_argument);
  EXPECT_THROW(WavelengthGrid::uniform(400, 700, -4), std::invalid_argument);
  EXPECT_THROW(WavelengthGrid::uniform(700, 400, 4), std::invalid_argument);
}

TEST(TabulatedSpectrum, IsLinearInBetweenAndConstantOutside) {
  const TabulatedSpectrum s({400, 500, 600}, {0.0, 1.0, 0.0});
  EXPECT_NEAR(s.at(425), 0.25, kRounding);
  EXPECT_EQ(s.at(300), 0.0);
  EXPECT_NEAR(s.at(500), 1.0, kRounding);
  EXPECT_TRUE(s.covers(400, 600));
  EXPECT_FALSE(s.covers(399, 500));
}

TEST(TabulatedSpectrum, BandMeansAreExact) {
  const TabulatedSpectrum s({400, 500, 600}, {0.0, 1.0, 0.0});
  // [450, 550]: two trapezia of mean 0.75.
  EXPECT_NEAR(s.band_mean(500, 100), 0.75, kRounding);
  EXPECT_NEAR(s.band_mean(500, 200), 0.5, kRounding);
}

TEST(TabulatedSpectrum, WeightedMeanIntegratesTheProduct) {
  const TabulatedSpectrum ramp({400, 600}, {0.0, 1.0}), weight({400, 600}, {0.0, 1.0});
  // integral x^2 / integral x on [0, 1] = (1/3) / (1/2).
  EXPECT_NEAR(ramp.weighted_mean(weight), 2.0 / 3.0, kRounding);
  EXPECT_THROW(ramp.weighted_mean(TabulatedSpectrum({400, 600}, {0.0, 0.0})),
               std::invalid_argument);
}

TEST(TabulatedSpectrum, RefusesWhatIsNoSpectrum) {
  EXPECT_THROW(TabulatedSpectrum({}, {}), std::invalid_argument);
  EXPECT_THROW(TabulatedSpectrum({400, 500}, {1.0}), std::invalid_argument);
  EXPECT_THROW(TabulatedSpectrum({500, 400}, {1.0, 1.0}), std::invalid_argument);
  EXPECT_THROW(TabulatedSpectrum({400, 500}, {1.0, kNaN}), std::invalid_argument);
}

TEST(SampleBands, TakesPointsOfACoarseTableAndMeansOfAFineOne) {
  const WavelengthGrid grid = WavelengthGrid::uniform(400, 440, 20);
  EXPECT_THAT(sample_bands(TabulatedSpectrum({400, 420, 440}, {0.1, 0.5, 0.2}), grid),
              ElementsAre(0.1, 0.5, 0.2));
  std::vector<double> nm, spike;
  for (int k = 390; k <= 450; ++k) nm.push_back(k), spike.push_back(k == 420 ? 1.0 : 0.0);
  // A triangle of base 2 nm and height 1 has area 1 nm: mean over 20 nm.
  EXPECT_NEAR(sample_bands(TabulatedSpectrum(nm, spike), grid)[1], 1.0 / 20.0, kRounding);
}

class CieObserver : public testing::Test {
 protected:
  const Observer observer_ = read_observer(
      std::string(TRUEBOX_REFERENCE_DIR) + "/colour/cie1931_2deg_xyz.csv", "CIE 1931 2 deg");
};

TEST_F(CieObserver, GivesTheEqualEnergyStimulusEqualTristimulus) {
  const WavelengthGrid grid = WavelengthGrid::uniform(360, 830, 1);
  const Tristimulus xyz = tristimulus(std::vector<double>(grid.size(), 1.0), grid, observer_);
  // CIE 15: sums of the 1 nm tables, 106.8655 .. 106.8921; the table has seven digits and its
  // half-bands at both ends hold less than 1e-4 nm.
  EXPECT_NEAR(xyz.Y, 106.8569, 2e-2);
  EXPECT_NEAR(xyz.X / xyz.Y, 1.0, 5e-4);
  EXPECT_NEAR(xyz.Z / xyz.Y, 1.0, 5e-4);
}

TEST_F(CieObserver, PlacesD65AtItsChromaticity) {
  const TabulatedSpectrum d65 = spectrum_from_table(
      read_table(std::string(TRUEBOX_REFERENCE_DIR) + "/colour/cie_illuminants.csv"), "D65");
  const WavelengthGrid grid = WavelengthGrid::uniform(360, 780, 5);
  const Tristimulus xyz = tristimulus(sample_bands(d65, grid), grid, observer_);
  const double sum = xyz.X + xyz.Y + xyz.Z;
  // CIE 15: x = 0.31272, y = 0.32903; 5 nm sums move the fifth digit.
  EXPECT_NEAR(xyz.X / sum, 0.31272, 5e-5);
  EXPECT_NEAR(xyz.Y / sum, 0.32903, 5e-5);
  const LinearRgb rgb = linear_bt709({xyz.X / xyz.Y, 1.0, xyz.Z / xyz.Y});
  for (double channel : rgb) EXPECT_NEAR(channel, 1.0, 2e-3);  // the matrix has four digits
}

TEST_F(CieObserver, WeightsAreTheTristimulusMap) {
  const WavelengthGrid grid = WavelengthGrid::uniform(400, 700, 20);
  std::vector<double> stimulus;
  for (std::size_t b = 0; b < grid.size(); ++b) stimulus.push_back(1.0 + std::sin(double(b)));
  const auto weights = band_weights(grid, observer_);
  double y = 0.0;
  for (std::size_t b = 0; b < grid.size(); ++b) y += stimulus[b] * weights[b].Y;
  EXPECT_NEAR(tristimulus(stimulus, grid, observer_).Y / y, 1.0, kRounding);
}

TEST(LambertianRadiance, IsRadiosityOverPi) {
  EXPECT_NEAR(lambertian_radiance(Radiosity(1, 1.0))[0], 0.31830988618379067, 1e-16);
}

}  // namespace
}  // namespace truebox

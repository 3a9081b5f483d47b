// SPDX-License-Identifier: BSD-3-Clause
#include "radiometry/lamp_weighting.h"

#include <gtest/gtest.h>

#include <cmath>

#include "difference/ciede2000.h"
#include "radiometry/table_file.h"

namespace truebox {
namespace {

const std::string kColour = std::string(TRUEBOX_REFERENCE_DIR) + "/colour/";

// Every fifth of a nanometre, so that products of two curves are lines to rounding of the eye.
WavelengthGrid fine_grid() { return WavelengthGrid::uniform(400.1, 699.9, 0.2); }

double cavity(double rho) { return rho / (1.0 - 0.9 * rho); }

class LampWeighting : public testing::Test {
 protected:
  TabulatedSpectrum illuminant(const std::string& name) const {
    return spectrum_from_table(read_table(kColour + "cie_illuminants.csv"), name);
  }

  // Three lines 20 nm wide over a weak continuum.
  static TabulatedSpectrum three_lines() {
    std::vector<double> nm, power;
    for (double x = 380.0; x <= 780.0; x += 1.0) {
      nm.push_back(x);
      power.push_back(0.02);
      for (const auto& [centre, height] : {std::pair{450.0, 0.8}, {545.0, 1.0}, {610.0, 0.9}})
        power.back() += height * std::exp(-0.5 * std::pow((x - centre) / 10.0, 2.0));
    }
    return {nm, power};
  }

  Tristimulus colour(const std::vector<double>& rho, const WavelengthGrid& grid,
                     const TabulatedSpectrum& lamp, double (*of)(double)) const {
    Tristimulus sum;
    const auto weights = lamp_weighted_band_weights(grid, observer_, lamp);
    for (std::size_t b = 0; b < grid.size(); ++b) {
      const double value = of(rho[b]) * lamp.band_mean(grid.centre_nm(b), grid.width_nm(b));
      sum.X += value * weights[b].X;
      sum.Y += value * weights[b].Y;
      sum.Z += value * weights[b].Z;
    }
    return sum;
  }

  // Largest dE00 over the 24 patches of a chart, each the walls of a closed cavity; white is the
  // cavity of a perfect diffuser.
  double largest_dE00(std::size_t bands, const TabulatedSpectrum& lamp, bool weighted,
                      double (*of)(double) = cavity) const {
    const TableFile chart = read_table(kColour + "colorchecker24_ohta.csv");
    const WavelengthGrid fine = fine_grid(), few = equal_bands(400.0, 700.0, bands);
    const Tristimulus white = colour(std::vector<double>(fine.size(), 1.0), fine, lamp, of);
    double largest = 0.0;
    for (std::size_t c = 1; c < chart.columns.size(); ++c) {
      const TabulatedSpectrum rho = spectrum_from_table(chart, chart.columns[c]);
      const Lab truth = cielab(colour(lamp_weighted_means(rho, fine, lamp), fine, lamp, of), white);
      const auto means = weighted ? lamp_weighted_means(rho, few, lamp) : sample_bands(rho, few);
      largest = std::max(largest, ciede2000(cielab(colour(means, few, lamp, of), white), truth));
    }
    return largest;
  }

  Observer observer_ = read_observer(kColour + "cie1931_2deg_xyz.csv", "CIE 1931 2 deg");
};

TEST_F(LampWeighting, MakesOneReflectionExactWithAnyNumberOfBands) {
  const auto once = [](double rho) { return rho; };
  for (const std::size_t bands : {3u, 8u})
    EXPECT_LT(largest_dE00(bands, three_lines(), true, once), 1.5)
        << "reflectance and matching function vary together within a band: small, not zero";
  // With the matching function even in a band there is nothing left to vary with.
  const TabulatedSpectrum lamp = three_lines(), rho({400, 700}, {0.1, 0.8});
  const WavelengthGrid bands = equal_bands(400, 700, 5), fine = equal_bands(400, 700, 3000);
  const auto few = lamp_weighted_means(rho, bands, lamp),
             many = lamp_weighted_means(rho, fine, lamp);
  double coarse = 0.0, exact = 0.0;
  for (std::size_t b = 0; b < bands.size(); ++b)
    coarse += few[b] * lamp.band_mean(bands.centre_nm(b), bands.width_nm(b)) * bands.width_nm(b);
  for (std::size_t b = 0; b < fine.size(); ++b)
    exact += many[b] * lamp.band_mean(fine.centre_nm(b), fine.width_nm(b)) * fine.width_nm(b);
  EXPECT_NEAR(coarse / exact, 1.0, 1e-12);
}

TEST_F(LampWeighting, KeepsManyReflectionsWithinOneDE00FromSixteenBandsOn) {
  for (const TabulatedSpectrum& lamp : {illuminant("D65"), illuminant("A"), three_lines()}) {
    const double eight = largest_dE00(8, lamp, true), sixteen = largest_dE00(16, lamp, true),
                 thirty_six = largest_dE00(36, lamp, true);
    EXPECT_LT(sixteen, 1.0);
    EXPECT_LT(thirty_six, 0.25);
    EXPECT_LT(sixteen, eight);
    RecordProperty("dE00_8_16_36", std::to_string(eight) + " " + std::to_string(sixteen) + " " +
                                       std::to_string(thirty_six));
  }
}

TEST_F(LampWeighting, BeatsPlainMeansUnderALampOfLines) {
  EXPECT_LT(largest_dE00(8, three_lines(), true), 0.7 * largest_dE00(8, three_lines(), false));
}

TEST_F(LampWeighting, TakesThePlainMeanWhereTheLampIsDark) {
  const TabulatedSpectrum lamp({500, 510, 520}, {0, 1, 0}), rho({400, 700}, {0.1, 0.7});
  const WavelengthGrid bands = equal_bands(400, 700, 3);
  const auto means = lamp_weighted_means(rho, bands, lamp);
  EXPECT_NEAR(means[2], rho.at(650), 1e-12);
  EXPECT_NEAR(means[1], rho.at(510), 1e-12) << "the lamp shines at 510 nm alone, evenly about it";
}

TEST_F(LampWeighting, RefusesNonsense) {
  EXPECT_THROW(equal_bands(700, 400, 3), std::invalid_argument);
  EXPECT_THROW(equal_bands(400, 700, 0), std::invalid_argument);
  const TabulatedSpectrum rho({400, 700}, {0.1, 0.7});
  EXPECT_THROW(lamp_weighted_means(rho, equal_bands(400, 700, 3), {}), std::invalid_argument);
  EXPECT_THROW(lamp_weighted_means(rho, equal_bands(400, 700, 3), {{400, 700}, {-1, 1}}),
               std::invalid_argument);
}

TEST_F(LampWeighting, BandsFillTheirSpan) {
  const WavelengthGrid bands = equal_bands(400, 700, 16);
  EXPECT_NEAR(bands.centre_nm(0) - 0.5 * bands.width_nm(0), 400.0, 1e-9);
  EXPECT_NEAR(bands.centre_nm(15) + 0.5 * bands.width_nm(15), 700.0, 1e-9);
  EXPECT_EQ(equal_bands(400, 700, 1).width_nm(0), 300.0);
}

}  // namespace
}  // namespace truebox

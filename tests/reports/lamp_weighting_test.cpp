// SPDX-License-Identifier: BSD-3-Clause
#include "radiometry/lamp_weighting.h"

#include <gtest/gtest.h>

#include <cmath>

#include "difference/ciede2000.h"
#include "radiometry/table_file.h"

namespace truebox {
namespace {

const std::string kColour = std::string(TRUEBOX_REFERENCE_DIR) + "/colour/";

// A nanometre each: 300 bands differ from 1500 by less than 1e-3 dE00.
WavelengthGrid fine_grid() { return equal_bands(400.0, 700.0, 300); }

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

  // Light of a lamp that a cavity of reflectance rho leaves, seen in some bands.
  class Seen {
   public:
    Seen(const WavelengthGrid& grid, const Observer& observer, const TabulatedSpectrum& lamp)
        : weights_(lamp_weighted_band_weights(grid, observer, lamp)) {
      for (std::size_t b = 0; b < grid.size(); ++b)
        light_.push_back(lamp.band_mean(grid.centre_nm(b), grid.width_nm(b)));
    }
    Tristimulus operator()(const std::vector<double>& rho) const {
      Tristimulus sum;
      for (std::size_t b = 0; b < rho.size(); ++b) {
        const double value = cavity(rho[b]) * light_[b];
        sum.X += value * weights_[b].X;
        sum.Y += value * weights_[b].Y;
        sum.Z += value * weights_[b].Z;
      }
      return sum;
    }

   private:
    std::vector<Tristimulus> weights_;
    std::vector<double> light_;
  };

  // Largest dE00 over the 24 patches of a chart, each the walls of a closed cavity; white is the
  // cavity of a perfect diffuser.
  double largest_dE00(std::size_t bands, const TabulatedSpectrum& lamp, bool weighted) const {
    const WavelengthGrid fine = fine_grid(), few = equal_bands(400.0, 700.0, bands);
    const Seen in_fine(fine, observer_, lamp), in_few(few, observer_, lamp);
    const Tristimulus white = in_fine(std::vector<double>(fine.size(), 1.0));
    double largest = 0.0;
    for (const TabulatedSpectrum& rho : patches_) {
      const Lab truth = cielab(in_fine(sample_bands(rho, fine)), white);
      const auto means = weighted ? lamp_weighted_means(rho, few, lamp) : sample_bands(rho, few);
      largest = std::max(largest, ciede2000(cielab(in_few(means), white), truth));
    }
    return largest;
  }

  static std::vector<TabulatedSpectrum> chart() {
    const TableFile table = read_table(kColour + "colorchecker24_ohta.csv");
    std::vector<TabulatedSpectrum> patches;
    for (std::size_t c = 1; c < table.columns.size(); ++c)
      patches.push_back(spectrum_from_table(table, table.columns[c]));
    return patches;
  }

  std::vector<TabulatedSpectrum> patches_ = chart();
  Observer observer_ = read_observer(kColour + "cie1931_2deg_xyz.csv", "CIE 1931 2 deg");
};

TEST_F(LampWeighting, KeepsTheFluxOfOneReflectionWhateverTheNumberOfBands) {
  const TabulatedSpectrum lamp = three_lines(), rho({400, 700}, {0.1, 0.8});
  const auto flux = [&](std::size_t bands) {
    const WavelengthGrid grid = equal_bands(400, 700, bands);
    const auto means = lamp_weighted_means(rho, grid, lamp);
    double sum = 0.0;
    for (std::size_t b = 0; b < bands; ++b)
      sum += means[b] * lamp.band_mean(grid.centre_nm(b), grid.width_nm(b)) * grid.width_nm(b);
    return sum;
  };
  EXPECT_NEAR(flux(1) / flux(3000), 1.0, 1e-12);
  EXPECT_NEAR(flux(5) / flux(3000), 1.0, 1e-12);
}

TEST_F(LampWeighting, KeepsManyReflectionsWithinOneDE00FromSixteenBandsOn) {
  const std::pair<const char*, TabulatedSpectrum> lamps[] = {
      {"D65", illuminant("D65")}, {"A", illuminant("A")}, {"lines", three_lines()}};
  for (const auto& [name, lamp] : lamps) {
    const double eight = largest_dE00(8, lamp, true), sixteen = largest_dE00(16, lamp, true),
                 thirty_six = largest_dE00(36, lamp, true);
    EXPECT_LT(sixteen, 1.0);
    EXPECT_LT(thirty_six, 0.25);
    EXPECT_LT(sixteen, eight);
    RecordProperty(
        std::string("dE00_8_16_36_") + name,
        std::to_string(eight) + " " + std::to_string(sixteen) + " " + std::to_string(thirty_six));
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

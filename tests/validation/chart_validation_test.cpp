// SPDX-License-Identifier: BSD-3-Clause
// The real photographs of a ColorChecker against the spectrometer's reading of it. The coloured
// patches' spectra enter no fit: they judge it.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "fit/chart_measurement.h"

namespace truebox {
namespace {

const std::string kFile =
    std::string(TRUEBOX_REFERENCE_DIR) + "/llanos_narrowband/measurement.toml";

const ChartMeasurement& measured() {
  static const ChartMeasurement measurement = measure_chart(read_measurement(kFile));
  return measurement;
}

const BandMeasurement& band(const std::string& name) {
  for (const auto& b : measured().bands)
    if (b.name == name) return b;
  throw std::invalid_argument("no band " + name);
}

TEST(ChartValidation, EveryFitConverges) {
  EXPECT_EQ(measured().outcome(), Outcome::converged);
  ASSERT_EQ(measured().bands.size(), 7u);
  for (const auto& b : measured().bands) EXPECT_EQ(b.readings.size(), 24u) << b.name;
}

TEST(ChartValidation, HeldOutPatchesAgreeWithinTheBaseline) {
  // RMS difference (reflectance, 1) of a simpler analysis of these photographs: a quadratic
  // illumination fitted with the help of every patch's spectrum. With the colours held out the fit
  // must not be worse.
  const std::map<std::string, double> baseline = {
      {"400 nm", 0.064}, {"450 nm", 0.011}, {"500 nm", 0.010}, {"550 nm", 0.009},
      {"600 nm", 0.017}, {"650 nm", 0.012}, {"700 nm", 0.021}};
  for (const auto& b : measured().bands) {
    EXPECT_EQ(b.held_out, 18u);
    EXPECT_LE(b.rms, baseline.at(b.name)) << b.name;
    EXPECT_GT(b.rms, 1e-4) << b.name << ": too good for 8-bit photographs, is it held out?";
  }
}

TEST(ChartValidation, EnScoresAreThoseOfAnHonestBudget) {
  // With k = 2 and a right budget about 95 % of the scores stay within 1. Fewer than 85 % means
  // that a contribution is missing; an RMS score below 0.25 that the budget hides (RMS 0.5 is
  // ideal).
  double squares = 0.0;
  for (const auto& b : measured().bands)
    for (const auto& r : b.readings)
      if (!r.standard) squares += r.en.value * r.en.value;
  const double held_out = static_cast<double>(measured().held_out());
  EXPECT_EQ(measured().held_out(), 126u);
  EXPECT_GE(static_cast<double>(measured().agreeing()), 0.85 * held_out);
  EXPECT_GE(std::sqrt(squares / held_out), 0.25);
  EXPECT_LE(std::sqrt(squares / held_out), 0.75);
}

TEST(ChartValidation, ColouredSpectraDoNotEnterTheFit) {
  // Ruin the held-out reference: the fitted values must not move by a bit.
  MeasurementFile file = read_measurement(kFile);
  file.bands.resize(2);
  const ChartMeasurement before = measure_chart(file);
  std::rotate(file.chart.patches.begin(), file.chart.patches.begin() + 1,
              file.chart.patches.begin() + 18);
  const ChartMeasurement after = measure_chart(file);
  for (std::size_t b = 0; b < 2; ++b)
    for (std::size_t p = 0; p < 18; ++p) {
      const PatchReading& x = before.bands[b].readings[p];
      const PatchReading& y = after.bands[b].readings[p];
      EXPECT_EQ(x.measured.value, y.measured.value) << p;
      EXPECT_NE(x.reference.value, y.reference.value) << p;
    }
}

TEST(ChartValidation, TheCameraIsLinearOnceItsResponseIsKnown) {
  const auto& response = measured().instrument.response;
  // The exposures contradict a linear camera with a true zero several times over.
  EXPECT_GT(response.chi2_per_dof_linear, 3.0 * response.chi2_per_dof);
  EXPECT_GT(response.response.curvature_per_dn.value,
            5.0 * response.response.curvature_per_dn.standard_uncertainty);
  EXPECT_LT(response.response.offset_dn.value, 0.0) << "the black level is clipped below zero";
  for (const auto& b : measured().bands) {
    EXPECT_LT(b.merge.chi2_per_dof, 1.1) << b.name;
    EXPECT_GT(b.merge.dof, 1000u) << b.name;
  }
}

TEST(ChartValidation, GreenPhotositesDoNotSee400nm) {
  // The greys alone tell: blue photosites fit them, green ones, although brighter, do not.
  const auto& sites = band("400 nm").sites;
  const auto site = [&](char c) {
    return *std::find_if(sites.begin(), sites.end(), [c](const auto& s) { return s.site == c; });
  };
  EXPECT_GT(site('G').white_dn, site('B').white_dn);
  EXPECT_GT(site('G').standards_rms, 2.0 * site('B').standards_rms);
  EXPECT_GT(site('G').held_out_rms, 3.0 * site('B').held_out_rms);
  EXPECT_TRUE(site('B').used);
}

TEST(ChartValidation, AVeilIsKeptWhereTheGreysDemandItOnly) {
  for (const auto& b : measured().bands) {
    EXPECT_EQ(b.veil_kept, b.name == "700 nm") << b.name;
    if (!b.veil_kept) {
      EXPECT_LT(std::abs(b.veil.value), 3.0 * b.veil.standard_uncertainty);
    }
  }
  EXPECT_GT(band("700 nm").veil.value, 5.0 * band("700 nm").veil.standard_uncertainty);
}

TEST(ChartValidation, PlanesShowWhatTheTableSays) {
  const auto& b = band("550 nm");
  const ChartPlanes& planes = b.planes;
  ASSERT_EQ(planes.width * planes.height, static_cast<int>(planes.photograph.size()));
  ASSERT_EQ(planes.photograph.size(), planes.prediction.size());
  std::vector<double> ratio(24, 0.0), n(24, 0.0);
  for (std::size_t i = 0; i < planes.patch.size(); ++i) {
    if (planes.patch[i] == 0) {
      EXPECT_EQ(planes.prediction[i], 0.0f);
      continue;
    }
    EXPECT_GT(planes.prediction_variance[i], 0.0f);
    ratio[planes.patch[i] - 1u] += planes.photograph[i] / planes.prediction[i];
    n[planes.patch[i] - 1u] += 1.0;
  }
  for (std::size_t p = 0; p < 24; ++p) {
    ASSERT_GT(n[p], 50.0) << p;
    // 1.5 %: the two field orders are averaged before and after the division.
    EXPECT_NEAR(ratio[p] / n[p], b.readings[p].measured.value / b.readings[p].reference.value,
                0.015)
        << b.readings[p].patch;
  }
}

}  // namespace
}  // namespace truebox

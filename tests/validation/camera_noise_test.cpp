// SPDX-License-Identifier: BSD-3-Clause
// Real photographs: does the noise found in some frames predict that of others?
#include <gtest/gtest.h>

#include <cmath>

#include "photometry/photometric_calibration.h"

namespace truebox {
namespace {

const std::string kFolder = std::string(TRUEBOX_REFERENCE_DIR) + "/llanos_narrowband/";

void expect_prediction_of_unseen_frames(const std::string& file) {
  const auto calibration = calibrate_photographs(read_measurement(kFolder + file));
  ASSERT_EQ(calibration.photographs.size(), 7u);
  ASSERT_EQ(calibration.instruments[0].noise.size(), 3u);
  for (const SiteNoise& noise : calibration.instruments[0].noise) {
    EXPECT_GE(noise.pooled.samples, 1000u) << noise.site;
    EXPECT_NEAR(noise.pooled.chi2_per_dof, 1.0, 0.1) << noise.site;  // 5 % of the noise itself
    EXPECT_LT(noise.pooled.outliers, noise.pooled.samples / 100) << noise.site;
  }
}

// Each filter in turn is left out of the fit; what is predicted for its frames is then measured.
TEST(CameraNoise, OfTheDiskFramesIsPredictedFilterByFilter) {
  expect_prediction_of_unseen_frames("disks.toml");
  const auto calibration = calibrate_photographs(read_measurement(kFolder + "disks.toml"));
  for (const SiteNoise& noise : calibration.instruments[0].noise) {
    for (const HeldOutNoise& group : noise.held_out)
      EXPECT_NEAR(group.check.chi2_per_dof, 1.0, 0.1) << noise.site << " " << group.group;
    // Nothing but noise is in these differences: they scatter as chi^2 does.
    EXPECT_NEAR(noise.transfer.dispersion, 1.0, 0.15) << noise.site;
  }
}

// Scaled down and rounded to 8 bit, these frames have a noise below the rounding step: single
// filters depart by more than a tenth, the sum of all does not.
TEST(CameraNoise, OfTheChartFramesIsPredictedInTheMeanOverFilters) {
  expect_prediction_of_unseen_frames("measurement.toml");
}

// One sensor: the colours' gains are the same within their uncertainties.
TEST(CameraNoise, GainIsTheSameForAllColoursAtTheSensorsResolution) {
  const auto calibration = calibrate_photographs(read_measurement(kFolder + "disks.toml"));
  const auto& noise = calibration.instruments[0].noise;
  for (std::size_t a = 0; a < noise.size(); ++a)
    for (std::size_t b = 0; b < a; ++b)
      EXPECT_NEAR(noise[a].model.gain_dn, noise[b].model.gain_dn,
                  3.0 * std::hypot(noise[a].transfer.gain_u_dn, noise[b].transfer.gain_u_dn));
}

}  // namespace
}  // namespace truebox

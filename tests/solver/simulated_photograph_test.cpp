// SPDX-License-Identifier: BSD-3-Clause
#include "sensor/simulated_photograph.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "support/tiny_scenes.h"

namespace truebox {
namespace {

// Furnace: rho = 1/2 and E = 1 everywhere in a closed cube give B = 2, whatever the lens does.
TEST(SimulatedPhotograph, SeesTheFurnaceThroughADistortingLens) {
  const Scene scene = tiny::cube(1.0, 0.5, 1.0);
  CameraDescription camera;
  camera.position_m = {0.4, 0.5, 0.6};
  camera.direction = {0.3, 0.2, -1.0};
  camera.focal_length_m = 0.02;
  camera.pixels = {12, 12};
  camera.lens.distortion = {.k1 = -0.1, .p1 = 0.004, .s1 = 0.003};
  camera.lens.f_number = 4.0;
  camera.sensor = SensorDescription{};
  camera.sensor->channels = {{"Y", TabulatedSpectrum({550.0}, {0.5})}};
  camera.sensor->exposure_s = 1e-9;
  PredictOptions options;
  options.elements = 96;
  const Prediction prediction(scene, options);
  const auto photograph = simulate_photograph(prediction, camera, {}, 7);
  // pi L / (4 N^2) A t eta l / (h c), one band of 1 nm at 550 nm, L = 2 / pi.
  const double pixel_m = 0.025 / 12.0;
  const double electrons =
      2.0 / (4.0 * 16.0) * pixel_m * pixel_m * 1e-9 * 0.5 * 550e-9 / (6.62607015e-34 * 299792458.0);
  double chi2 = 0.0;
  for (std::size_t i = 0; i < 144; ++i) {
    const double bound = photograph.scene.error_bound.channels[0].samples[i];
    EXPECT_NEAR(photograph.scene.radiance.channels[0].samples[i], 2.0 / std::numbers::pi,
                bound + 1e-6)
        << "the prediction's own bound and a float's rounding";
    const double expected = photograph.image.expected.channels[0].samples[i];
    EXPECT_NEAR(expected / electrons, 1.0, bound * std::numbers::pi / 2.0 + 1e-6);
    const double error = photograph.image.reading.channels[0].samples[i] - expected;
    chi2 += error * error / photograph.image.variance.channels[0].samples[i] / 144.0;
  }
  EXPECT_LT(std::abs(chi2 - 1.0), 3.9 * std::sqrt(2.0 / 144.0)) << "level 0.01 %";
  camera.sensor.reset();
  EXPECT_ANY_THROW(simulate_photograph(prediction, camera, {}, 7)) << "no sensor to expose";
}

}  // namespace
}  // namespace truebox

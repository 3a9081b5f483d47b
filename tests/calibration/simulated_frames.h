// SPDX-License-Identifier: BSD-3-Clause
// Truth first, noise second: simulated readings of a linear camera.
#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "readings/photograph.h"

namespace truebox {

struct SimulatedSensor {
  double gain_dn = 0.05;  ///< DN per photo-electron
  double read_noise_dn = 0.6;
  double black_dn = 0.0;
  double top_dn = 1e9;
  bool rounded = true;
};

/// One frame of a scene whose rate is given photosite by photosite, electrons a second.
inline Frame simulated_frame(const std::vector<double>& electrons_per_s, int width,
                             double exposure_s, const SimulatedSensor& sensor,
                             std::mt19937_64& random) {
  Frame frame{.path = "simulated", .exposure_s = exposure_s, .image = {}};
  frame.image = Image(width, static_cast<int>(electrons_per_s.size()) / width);
  auto& y = frame.image.add_channel("Y").samples;
  std::normal_distribution<double> read(0.0, 1.0);
  for (std::size_t i = 0; i < y.size(); ++i) {
    const double mean = electrons_per_s[i] * exposure_s;
    const double electrons =
        mean > 0.0 ? static_cast<double>(std::poisson_distribution<long>(mean)(random)) : 0.0;
    double reading =
        sensor.black_dn + sensor.gain_dn * electrons + sensor.read_noise_dn * read(random);
    if (sensor.rounded) reading = std::clamp(std::round(reading), 0.0, sensor.top_dn);
    y[i] = static_cast<float>(reading);
  }
  return frame;
}

/// A scene with shading and texture: rates from 30 % to 100 % of `peak`.
inline std::vector<double> textured_scene(int width, int height, double peak, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> texture(1.0, 0.05);
  std::vector<double> rates;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      rates.push_back(peak * (0.3 + 0.6 * x / width) * std::max(texture(random), 0.1));
  return rates;
}

}  // namespace truebox

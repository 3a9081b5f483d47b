// SPDX-License-Identifier: BSD-3-Clause
#include "photometry/noise_model.h"

#include <algorithm>
#include <cmath>

namespace truebox {

std::vector<NoiseSample> second_difference_noise(const Frame& frame, const BayerPattern& bayer,
                                                 const std::vector<std::uint8_t>& labels,
                                                 std::size_t patches, double saturation_dn) {
  (void)bayer;  // neighbours two pixels apart share their colour in every 2 x 2 pattern
  struct Sums {
    double reading = 0.0, square = 0.0, top = 0.0;
    std::size_t n = 0;
  };
  std::vector<Sums> sums(4 * (patches + 1));
  const Image& image = frame.image;
  const auto& y = image.channels[0].samples;
  for (int row = 0; row < image.height; ++row)
    for (int x = 2; x + 2 < image.width; ++x) {
      const std::size_t i = image.index(x, row);
      if (labels[i] == 0 || labels[i - 2] != labels[i] || labels[i + 2] != labels[i]) continue;
      Sums& s = sums[4 * labels[i] + static_cast<std::size_t>((row & 1) * 2 + (x & 1))];
      const double second = double{y[i - 2]} - 2.0 * y[i] + y[i + 2];
      s.reading += y[i];
      s.square += second * second;
      s.top = std::max({s.top, double{y[i - 2]}, double{y[i]}, double{y[i + 2]}});
      ++s.n;
    }
  std::vector<NoiseSample> samples;
  for (const Sums& s : sums)
    if (s.n >= 30 && s.top < saturation_dn && s.reading > 3.0 * static_cast<double>(s.n))
      samples.push_back(
          {s.reading / static_cast<double>(s.n), s.square / (6.0 * static_cast<double>(s.n)), s.n});
  return samples;
}

NoiseModel estimate_noise(const std::vector<NoiseSample>& samples) {
  NoiseModel model;
  if (samples.size() < 2) return model;
  // Two passes: the weight of a sample follows from the line, not from its own scatter.
  for (int pass = 0; pass < 3; ++pass) {
    double w = 0.0, wx = 0.0, wy = 0.0, wxx = 0.0, wxy = 0.0;
    for (const NoiseSample& s : samples) {
      const double v = pass == 0 ? 1.0 : model.variance_dn2(s.mean_dn);
      const double weight = static_cast<double>(s.count) / (v * v);
      w += weight;
      wx += weight * s.mean_dn;
      wy += weight * s.variance_dn2;
      wxx += weight * s.mean_dn * s.mean_dn;
      wxy += weight * s.mean_dn * s.variance_dn2;
    }
    const double determinant = w * wxx - wx * wx;
    if (!(determinant > 1e-12 * w * wxx)) {
      model.floor_dn2 = std::max(wy / w, kQuantisationVariance_dn2);
      return model;
    }
    model.gain_dn = std::max(0.0, (w * wxy - wx * wy) / determinant);
    model.floor_dn2 = (wy - model.gain_dn * wx) / w;
    if (model.floor_dn2 < kQuantisationVariance_dn2) {
      model.floor_dn2 = kQuantisationVariance_dn2;
      model.gain_dn = std::max(0.0, (wxy - model.floor_dn2 * wx) / wxx);
    }
  }
  return model;
}

}  // namespace truebox

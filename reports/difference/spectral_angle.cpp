// SPDX-License-Identifier: BSD-3-Clause
#include "difference/spectral_angle.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace truebox {

MetricMap spectral_angle(const DifferenceMap& map) {
  std::vector<const DifferenceChannel*> bands;
  for (const auto& channel : map.channels)
    if (channel.wavelength_nm > 0.0) bands.push_back(&channel);
  if (bands.size() < 2) throw std::invalid_argument("a spectral angle needs two spectral bands");
  MetricMap result{"angle", "Spectral angle", "deg", map.width, map.height, {}};
  result.values.resize(bands[0]->reference.size());
  for (std::size_t i = 0; i < result.values.size(); ++i) {
    double tt = 0.0, rr = 0.0;
    for (const auto* band : bands) {
      const double r = band->reference[i], t = r + band->difference[i];
      tt += t * t;
      rr += r * r;
    }
    if (tt == 0.0 || rr == 0.0) {
      result.values[i] = tt == rr ? 0.0f : 90.0f;
      continue;
    }
    // The chord between the unit vectors: acos of the product would lose half the digits near 0.
    double chord = 0.0;
    for (const auto* band : bands) {
      const double r = band->reference[i], t = r + band->difference[i];
      chord += std::pow(t / std::sqrt(tt) - r / std::sqrt(rr), 2);
    }
    const double angle = 2.0 * std::asin(std::min(1.0, 0.5 * std::sqrt(chord)));
    result.values[i] = static_cast<float>(angle * 180.0 / std::numbers::pi);
    if (!std::isfinite(tt) || !std::isfinite(rr)) result.values[i] = std::nanf("");
  }
  return result;
}

}  // namespace truebox

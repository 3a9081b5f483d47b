// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "image/bayer.h"
#include "readings/photograph.h"

namespace truebox {

/// Rounding to whole numbers: variance of a uniform distribution one step wide, DN^2.
inline constexpr double kQuantisationVariance_dn2 = 1.0 / 12.0;

/// variance(reading) = floor + gain * signal, DN^2.
/// floor: read noise and quantisation; gain: photon noise, DN per photo-electron. The photon
/// transfer relation. Source: EMVA Standard 1288 (2021), section 2.5.
struct NoiseModel {
  double floor_dn2 = kQuantisationVariance_dn2;
  double gain_dn = 0.0;

  double variance_dn2(double signal_dn) const {
    return floor_dn2 + gain_dn * (signal_dn > 0.0 ? signal_dn : 0.0);
  }
};

/// Mean and variance of readings of one uniform area, from `count` differences.
struct NoiseSample {
  double mean_dn = 0.0;
  double variance_dn2 = 0.0;
  std::size_t count = 0;
};

/// One sample a patch: variance = mean((y[x-2] - 2 y[x] + y[x+2])^2) / 6 over photosites of the
/// same colour. The second difference removes shading, linear over 5 px, but not the texture of
/// the patch: the estimate is an upper bound. For cameras that left one frame an exposure.
std::vector<NoiseSample> second_difference_noise(const Frame& frame, const BayerPattern& bayer,
                                                 const std::vector<std::uint8_t>& labels,
                                                 std::size_t patches, double saturation_dn);

/// Weighted straight line through the samples (weight count / variance^2), gain >= 0 and
/// floor >= the quantisation variance.
NoiseModel estimate_noise(const std::vector<NoiseSample>& samples);

}  // namespace truebox

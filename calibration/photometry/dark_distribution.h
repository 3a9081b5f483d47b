// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "radiometry/estimate.h"

namespace truebox {

/// A normal distribution seen through rounding and a clip at digital zero: reading k has the
/// probability of (k - 1/2, k + 1/2), reading 0 that of everything below 1/2. DN.
struct DarkDistribution {
  bool found = false;  ///< false: the readings cannot tell the two (or the one) apart
  Estimate mean_dn;    ///< the black level, below zero where the clip hides it
  Estimate sigma_dn;
  double correlation = 0.0;
  std::size_t readings = 0;
  std::size_t filled_bins = 0;  ///< that hold at least 10 readings
};

/// Maximum likelihood from counts of the readings 0, 1, 2, ... Two numbers need three bins of at
/// least 10 readings each; with `known_sigma_dn` two bins give the mean. Otherwise `found` is
/// false: a dark that is nearly all zeros does not tell its noise from its level.
/// Uncertainties from the expected information. Source: Widrow, Kollar (2008), Quantization Noise.
DarkDistribution fit_dark_distribution(const std::vector<std::size_t>& counts,
                                       std::optional<double> known_sigma_dn = std::nullopt);

}  // namespace truebox

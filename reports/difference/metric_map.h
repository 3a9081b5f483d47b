// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "difference/difference_statistics.h"

namespace truebox {

/// One number a pixel that says how much two images differ there: 0 is no difference, larger is
/// worse. NaN where either image holds no number.
struct MetricMap {
  std::string name;   ///< as a limit names it: "ciede2000", "flip"
  std::string title;  ///< "CIEDE2000"
  std::string unit;   ///< "1", "deg"
  int width = 0;
  int height = 0;
  std::vector<float> values;
};

/// Statistics over the finite values of a map inside a mask (empty: all pixels count).
struct MetricSummary {
  std::size_t pixels = 0;      ///< that count
  std::size_t not_finite = 0;  ///< of these, left out below
  double mean = 0.0;
  double p50 = 0.0, p95 = 0.0, p99 = 0.0;  ///< smallest value that covers the share
  double max = 0.0;
  SamplePosition max_at;
};
MetricSummary metric_summary(const MetricMap& map, std::span<const std::uint8_t> mask = {});

/// Red, green and blue of equal size, row by row; what they mean is said where they are used.
using RgbPlanes = std::array<std::vector<float>, 3>;

}  // namespace truebox

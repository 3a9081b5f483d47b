// SPDX-License-Identifier: BSD-3-Clause
#include "difference/metric_map.h"

#include <cmath>
#include <stdexcept>

namespace truebox {

MetricSummary metric_summary(const MetricMap& map, std::span<const std::uint8_t> mask) {
  if (!mask.empty() && mask.size() != map.values.size())
    throw std::invalid_argument("the mask has another size than the map");
  MetricSummary s;
  std::vector<float> finite;
  double sum = 0.0;
  for (std::size_t i = 0; i < map.values.size(); ++i) {
    if (!mask.empty() && mask[i] == 0) continue;
    ++s.pixels;
    const float v = map.values[i];
    if (!std::isfinite(v)) {
      ++s.not_finite;
      continue;
    }
    if (finite.empty() || v > s.max) {
      s.max = v;
      const auto width = static_cast<std::size_t>(map.width);
      s.max_at = {static_cast<int>(i % width), static_cast<int>(i / width), map.name};
    }
    sum += v;
    finite.push_back(v);
  }
  s.mean = sum / static_cast<double>(finite.size());  // 0 / 0 is NaN: nothing was compared
  if (finite.empty()) s.max = s.mean;
  s.p50 = nearest_rank(finite, 0.50);
  s.p95 = nearest_rank(finite, 0.95);
  s.p99 = nearest_rank(finite, 0.99);
  return s;
}

}  // namespace truebox

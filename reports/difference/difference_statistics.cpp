// SPDX-License-Identifier: BSD-3-Clause
#include "difference/difference_statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace truebox {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

SamplePosition position(const DifferenceMap& map, std::size_t pixel, const std::string& channel) {
  const auto width = static_cast<std::size_t>(map.width);
  return {static_cast<int>(pixel % width), static_cast<int>(pixel / width), channel};
}

/// Nearest rank: the smallest magnitude that at least the given fraction does not exceed.
double percentile(std::vector<float>& magnitudes, double fraction) {
  if (magnitudes.empty()) return kNaN;
  const double n = static_cast<double>(magnitudes.size());
  const auto rank = static_cast<std::size_t>(std::max(1.0, std::ceil(fraction * n))) - 1;
  const auto at = magnitudes.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(magnitudes.begin(), at, magnitudes.end());
  return *at;
}

bool is_finite(const DifferenceChannel& channel, std::size_t pixel) {
  return std::isfinite(channel.difference[pixel]) && std::isfinite(channel.reference[pixel]);
}

double on_scale(const DifferenceChannel& channel, std::size_t pixel, DifferenceScale scale) {
  const double d = std::abs(static_cast<double>(channel.difference[pixel]));
  if (scale == DifferenceScale::sigmas) return std::abs(channel.sigmas(pixel));
  if (scale == DifferenceScale::absolute || d == 0.0) return d;
  return d / std::abs(static_cast<double>(channel.reference[pixel]));
}

void require_valid(const DifferenceMap& map, const DifferenceLimits& limits) {
  if (!(limits.warn >= 0.0 && limits.fail >= limits.warn && std::isfinite(limits.fail)))
    throw std::invalid_argument("limits must be finite with 0 <= warn <= fail");
  if (!(limits.allowed_fraction >= 0.0 && limits.allowed_fraction <= 1.0))
    throw std::invalid_argument("the allowed fraction of outliers must lie in [0, 1]");
  if (limits.scale == DifferenceScale::sigmas && !map.has_uncertainty())
    throw std::invalid_argument("limits in sigmas need an uncertainty for every channel");
}

}  // namespace

DifferenceStatistics difference_statistics(const DifferenceMap& map) {
  DifferenceStatistics s;
  double sum = 0, sum_abs = 0, sum_square = 0, reference_abs = 0, reference_square = 0, sum_z2 = 0;
  const bool with_sigmas = map.has_uncertainty();
  std::vector<float> magnitudes;
  for (const auto& channel : map.channels) {
    for (std::size_t i = 0; i < channel.difference.size(); ++i) {
      ++s.samples;
      if (!is_finite(channel, i)) {
        ++s.not_finite;
        continue;
      }
      const double d = channel.difference[i], r = channel.reference[i];
      sum += d;
      sum_abs += std::abs(d);
      sum_square += d * d;
      reference_abs += std::abs(r);
      reference_square += r * r;
      if (with_sigmas) sum_z2 += channel.sigmas(i) * channel.sigmas(i);
      if (magnitudes.empty() || std::abs(d) > s.max_absolute) {
        s.max_absolute = std::abs(d);
        s.max_at = position(map, i, channel.name);
      }
      magnitudes.push_back(static_cast<float>(std::abs(d)));
    }
  }
  const double n =
      static_cast<double>(magnitudes.size());  // n = 0 leaves NaN: nothing was compared
  s.bias = sum / n;
  s.mean_absolute = sum_abs / n;
  s.rms = std::sqrt(sum_square / n);
  s.relative_bias = reference_abs > 0.0 ? sum / reference_abs : kNaN;
  s.relative_mean_absolute = reference_abs > 0.0 ? sum_abs / reference_abs : kNaN;
  s.relative_rms = reference_square > 0.0 ? std::sqrt(sum_square / reference_square) : kNaN;
  s.rms_sigmas = with_sigmas ? std::sqrt(sum_z2 / n) : kNaN;
  if (magnitudes.empty()) s.max_absolute = kNaN;
  s.p50 = percentile(magnitudes, 0.50);
  s.p95 = percentile(magnitudes, 0.95);
  s.p99 = percentile(magnitudes, 0.99);
  return s;
}

DifferenceGate apply_limits(const DifferenceMap& map, const DifferenceLimits& limits) {
  require_valid(map, limits);
  DifferenceGate gate;
  gate.limits = limits;
  gate.pixels = static_cast<std::size_t>(map.width) * static_cast<std::size_t>(map.height);
  for (std::size_t i = 0; i < gate.pixels; ++i) {
    bool finite = true;
    double worst = 0.0;
    for (const auto& channel : map.channels) {
      const double magnitude = on_scale(channel, i, limits.scale);
      finite = finite && is_finite(channel, i) && !std::isnan(magnitude);
      if (!finite) break;
      worst = std::max(worst, magnitude);
      if (std::isfinite(magnitude) &&
          (magnitude > gate.largest || gate.largest_at.channel.empty())) {
        gate.largest = magnitude;
        gate.largest_at = position(map, i, channel.name);
      }
    }
    if (!finite) ++gate.pixels_not_finite;
    if (!finite || worst > limits.warn) ++gate.pixels_over_warn;
    if (!finite || worst > limits.fail) ++gate.pixels_over_fail;
  }
  const double allowed = limits.allowed_fraction * static_cast<double>(gate.pixels);
  gate.outcome = Agreement::agrees;
  if (static_cast<double>(gate.pixels_over_warn) > allowed) gate.outcome = Agreement::warning;
  if (static_cast<double>(gate.pixels_over_fail) > allowed) gate.outcome = Agreement::fails;
  if (gate.pixels_not_finite > 0 || gate.pixels == 0) gate.outcome = Agreement::fails;
  return gate;
}

}  // namespace truebox

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

bool is_finite(const DifferenceChannel& channel, std::size_t pixel) {
  return std::isfinite(channel.difference[pixel]) && std::isfinite(channel.reference[pixel]);
}

double on_scale(const DifferenceChannel& channel, std::size_t pixel, DifferenceScale scale) {
  const double d = std::abs(static_cast<double>(channel.difference[pixel]));
  if (scale == DifferenceScale::sigmas) return std::abs(channel.score(pixel));
  if (scale == DifferenceScale::absolute || d == 0.0) return d;
  const double ratio = d / std::abs(static_cast<double>(channel.reference[pixel]));
  return scale == DifferenceScale::percent ? 100.0 * ratio : ratio;
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

namespace {

/// Mean |reference|, over what `difference_statistics` counts.
double mean_reference(const DifferenceMap& map, std::size_t from, std::size_t to) {
  double sum = 0.0, n = 0.0;
  for (std::size_t c = from; c < to; ++c)
    for (std::size_t i = 0; i < map.channels[c].difference.size(); ++i) {
      if (!map.counts(i) || !is_finite(map.channels[c], i)) continue;
      sum += std::abs(static_cast<double>(map.channels[c].reference[i]));
      n += 1.0;
    }
  return sum / n;
}

DifferenceStatistics statistics_of(const DifferenceMap& map, std::size_t from, std::size_t to) {
  DifferenceStatistics s;
  double sum = 0, sum_abs = 0, sum_square = 0, reference_abs = 0, reference_square = 0, sum_z2 = 0;
  double relative_square = 0, symmetric = 0, peak = 0;
  const bool with_sigmas = map.has_uncertainty();
  const double mean = mean_reference(map, from, to), epsilon = 0.01 * mean * mean;
  std::vector<float> magnitudes;
  for (std::size_t c = from; c < to; ++c) {
    const DifferenceChannel& channel = map.channels[c];
    for (std::size_t i = 0; i < channel.difference.size(); ++i) {
      if (!map.counts(i)) continue;
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
      peak = std::max(peak, std::abs(r));
      if (d != 0.0) {
        relative_square += d * d / (r * r + epsilon);
        symmetric += 2.0 * std::abs(d) / (std::abs(r + d) + std::abs(r));
      }
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
  s.relative_mse = reference_abs > 0.0 ? relative_square / n : kNaN;
  s.smape = symmetric / n;
  s.psnr_db = peak > 0.0 ? 20.0 * std::log10(peak / s.rms) : kNaN;
  s.rms_sigmas = with_sigmas ? std::sqrt(sum_z2 / n) : kNaN;
  if (magnitudes.empty()) s.max_absolute = kNaN;
  s.p50 = nearest_rank(magnitudes, 0.50);
  s.p95 = nearest_rank(magnitudes, 0.95);
  s.p99 = nearest_rank(magnitudes, 0.99);
  return s;
}

}  // namespace

double nearest_rank(std::vector<float>& values, double share) {
  if (values.empty()) return kNaN;
  const double n = static_cast<double>(values.size());
  const auto rank = static_cast<std::size_t>(std::max(1.0, std::ceil(share * n))) - 1;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

DifferenceStatistics difference_statistics(const DifferenceMap& map) {
  return statistics_of(map, 0, map.channels.size());
}

DifferenceStatistics channel_statistics(const DifferenceMap& map, std::size_t channel) {
  if (channel >= map.channels.size()) throw std::invalid_argument("no such channel");
  return statistics_of(map, channel, channel + 1);
}

DifferenceGate apply_limits(const DifferenceMap& map, const DifferenceLimits& limits) {
  require_valid(map, limits);
  DifferenceGate gate;
  gate.limits = limits;
  gate.pixels = map.pixel_count();
  const auto all = static_cast<std::size_t>(map.width) * static_cast<std::size_t>(map.height);
  for (std::size_t i = 0; i < all; ++i) {
    if (!map.counts(i)) continue;
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

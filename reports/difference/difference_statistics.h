// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <vector>

#include "difference/agreement.h"
#include "difference/difference_map.h"

namespace truebox {

/// Pixel (x, y) counted from the top left, and the channel.
struct SamplePosition {
  int x_px = 0;
  int y_px = 0;
  std::string channel;
};

/// Statistics of d = test - reference over the finite samples of a map that count, in its unit.
/// relMSE: Rousselle, Knaus, Zwicker (2011), ACM Trans. Graph. 30(6), its epsilon of 0.01 scaled by
/// the mean so that the number has no unit. SMAPE: Makridakis (1993), Int. J. Forecast. 9(4).
struct DifferenceStatistics {
  std::size_t samples = 0;     ///< pixels x channels
  std::size_t not_finite = 0;  ///< samples with NaN or Inf in test or reference (left out below)
  double bias = 0.0;           ///< mean d
  double mean_absolute = 0.0;  ///< mean |d|
  double rms = 0.0;            ///< sqrt(mean d^2)
  double relative_bias = 0.0;  ///< sum d / sum |reference|; NaN if the reference is black
  double relative_mean_absolute = 0.0;  ///< sum |d| / sum |reference|
  double relative_rms = 0.0;            ///< sqrt(sum d^2 / sum reference^2)
  double max_absolute = 0.0;            ///< max |d|
  SamplePosition max_at;
  double p50 = 0.0, p95 = 0.0, p99 = 0.0;  ///< percentiles of |d|: smallest value that covers them
  double relative_mse = 0.0;  ///< mean d^2 / (reference^2 + 0.01 m^2), m = mean |reference|
  double smape = 0.0;         ///< mean 2 |d| / (|test| + |reference|), in [0, 2]; both 0: 0
  double psnr_db = 0.0;       ///< 10 lg(max reference^2 / mean d^2); infinite where all are equal
  double rms_sigmas = 0.0;    ///< sqrt(mean z^2), 1 expected; NaN where no uncertainty is known
};
DifferenceStatistics difference_statistics(const DifferenceMap& map);

/// The same over one channel of the map.
DifferenceStatistics channel_statistics(const DifferenceMap& map, std::size_t channel);

/// The smallest of the values that at least the given share does not exceed; NaN if there is none.
/// Reorders the values.
double nearest_rank(std::vector<float>& values, double share);

/// What a limit is compared with.
enum class DifferenceScale {
  absolute,  ///< |d|, in the map's unit
  relative,  ///< |d| / |reference|; infinite on a black reference unless d = 0
  percent,   ///< 100 times that
  sigmas,    ///< |d| / u
};

/// idiff's rule: the gate fails if more than `allowed_fraction` of the pixels lie above `fail`,
/// warns if more lie above `warn`. A pixel counts once, by its worst channel.
struct DifferenceLimits {
  DifferenceScale scale = DifferenceScale::absolute;
  double warn = 0.0;
  double fail = 0.0;
  double allowed_fraction = 0.0;
};

/// NaN and Inf never pass: one sample that is not finite fails the gate, whatever the limits.
struct DifferenceGate {
  DifferenceLimits limits;
  std::size_t pixels = 0;
  std::size_t pixels_over_warn = 0;
  std::size_t pixels_over_fail = 0;
  std::size_t pixels_not_finite = 0;
  double largest = 0.0;  ///< the largest finite |d| on the limits' scale
  SamplePosition largest_at;
  Agreement outcome = Agreement::not_run;
};

/// Throws std::invalid_argument if the limits are negative or not finite, warn > fail, or sigmas
/// are asked for without an uncertainty.
DifferenceGate apply_limits(const DifferenceMap& map, const DifferenceLimits& limits);

}  // namespace truebox

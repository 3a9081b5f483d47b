// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <vector>

#include "difference/difference_statistics.h"
#include "difference/metric_map.h"

namespace truebox {

/// "quantity:warn:fail" or "quantity:warn:fail:outliers". The quantity is
/// - a pixel's: absolute, relative, percent, sigmas, or the name of a metric map (ciede2000, itp,
///   flip, hdr-flip, dssim, angle): `outliers` is the share of the pixels that may lie beyond;
/// - a number of the whole: bias, relative-bias (both without sign), mae, rmse, relative-mae,
///   relative-rmse, relmse, smape, or a metric map's name with "-mean": no outliers.
struct Limit {
  std::string quantity;
  double warn = 0.0;
  double fail = 0.0;
  double allowed_fraction = 0.0;
};

/// Throws std::invalid_argument, saying what is wrong, unless 0 <= warn <= fail are numbers, the
/// outliers are in [0, 1] ("1%" is 0.01) and the quantity is known.
Limit parse_limit(const std::string& text);

struct LimitResult {
  Limit limit;
  Agreement outcome = Agreement::not_run;
  bool of_pixels = false;
  double measured = 0.0;  ///< the largest of the finite pixels, or the number of the whole
  std::string unit;
  SamplePosition at;  ///< of the largest
  std::size_t pixels = 0, beyond_warn = 0, beyond_fail = 0, not_finite = 0;
};

/// Holds a limit against what was compared. NaN and Inf fail.
/// Throws std::invalid_argument if the quantity needs an uncertainty or a metric that is not there.
LimitResult apply_limit(const Limit& limit, const DifferenceMap& map,
                        const DifferenceStatistics& statistics, std::span<const MetricMap> metrics);

}  // namespace truebox

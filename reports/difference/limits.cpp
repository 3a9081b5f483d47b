// SPDX-License-Identifier: BSD-3-Clause
#include "difference/limits.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>
#include <stdexcept>

namespace truebox {
namespace {

constexpr std::array kMetrics = {"ciede2000", "itp", "flip", "hdr-flip", "dssim", "angle"};

std::optional<DifferenceScale> scale_of(const std::string& quantity) {
  if (quantity == "absolute") return DifferenceScale::absolute;
  if (quantity == "relative") return DifferenceScale::relative;
  if (quantity == "percent") return DifferenceScale::percent;
  if (quantity == "sigmas") return DifferenceScale::sigmas;
  return std::nullopt;
}

struct Whole {
  const char* name;
  double DifferenceStatistics::*value;
  bool has_unit;
};
constexpr std::array<Whole, 8> kWholes = {
    {{"bias", &DifferenceStatistics::bias, true},
     {"mae", &DifferenceStatistics::mean_absolute, true},
     {"rmse", &DifferenceStatistics::rms, true},
     {"relative-bias", &DifferenceStatistics::relative_bias, false},
     {"relative-mae", &DifferenceStatistics::relative_mean_absolute, false},
     {"relative-rmse", &DifferenceStatistics::relative_rms, false},
     {"relmse", &DifferenceStatistics::relative_mse, false},
     {"smape", &DifferenceStatistics::smape, false}}};

bool is_metric(const std::string& name) {
  for (const char* metric : kMetrics)
    if (name == metric || name == std::string(metric) + "-mean") return true;
  return false;
}

/// One number for all pixels, which can have no outliers.
bool is_whole(const std::string& name) {
  for (const Whole& whole : kWholes)
    if (name == whole.name) return true;
  return is_metric(name) && name.ends_with("-mean");
}

double number(std::string text, const std::string& limit) {
  const bool percent = text.ends_with("%");
  if (percent) text.pop_back();
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != '\0' || !std::isfinite(value) || value < 0.0)
    throw std::invalid_argument(
        fmt::format("'{}' in '{}' is no number from 0 upwards", text, limit));
  return percent ? value / 100.0 : value;
}

const MetricMap& metric(std::span<const MetricMap> metrics, const std::string& name) {
  for (const MetricMap& map : metrics)
    if (map.name == name) return map;
  throw std::invalid_argument(fmt::format(
      "a limit on {} needs {}", name, name == "angle" ? "two spectral bands" : "colour images"));
}

void set_outcome(LimitResult& r) {
  const double allowed = r.limit.allowed_fraction * static_cast<double>(r.pixels);
  r.outcome = Agreement::agrees;
  if (static_cast<double>(r.beyond_warn) > allowed) r.outcome = Agreement::warning;
  if (static_cast<double>(r.beyond_fail) > allowed) r.outcome = Agreement::fails;
  if (r.not_finite > 0 || r.pixels == 0) r.outcome = Agreement::fails;
}

LimitResult of_metric(const Limit& limit, const MetricMap& map, const DifferenceMap& difference) {
  const MetricSummary summary = metric_summary(map, difference.mask);
  LimitResult r{limit, {}, true, summary.max, map.unit, summary.max_at, 0, 0, 0, 0};
  r.pixels = summary.pixels;
  r.not_finite = summary.not_finite;
  for (std::size_t i = 0; i < map.values.size(); ++i) {
    if (!difference.counts(i)) continue;
    const float v = map.values[i];  // NaN is beyond both
    r.beyond_warn += !(v <= limit.warn);
    r.beyond_fail += !(v <= limit.fail);
  }
  set_outcome(r);
  return r;
}

LimitResult of_whole(const Limit& limit, double value, const std::string& unit) {
  LimitResult r{limit, {}, false, std::abs(value), unit, {}, 0, 0, 0, 0};
  r.outcome = r.measured <= limit.warn   ? Agreement::agrees
              : r.measured <= limit.fail ? Agreement::warning
                                         : Agreement::fails;  // NaN too
  return r;
}

}  // namespace

Limit parse_limit(const std::string& text) {
  std::vector<std::string> parts;
  for (std::size_t from = 0;;) {
    const std::size_t colon = text.find(':', from);
    parts.push_back(text.substr(from, colon - from));
    if (colon == std::string::npos) break;
    from = colon + 1;
  }
  if (parts.size() != 3 && parts.size() != 4)
    throw std::invalid_argument(
        fmt::format("'{}' is not QUANTITY:WARN:FAIL or QUANTITY:WARN:FAIL:OUTLIERS", text));
  Limit limit{parts[0], number(parts[1], text), number(parts[2], text), 0.0};
  if (parts.size() == 4) limit.allowed_fraction = number(parts[3], text);
  if (!scale_of(limit.quantity) && !is_metric(limit.quantity) && !is_whole(limit.quantity))
    throw std::invalid_argument(fmt::format("no quantity is called '{}'", limit.quantity));
  if (is_whole(limit.quantity) && parts.size() == 4)
    throw std::invalid_argument(fmt::format("{} is one number, it has no outliers", parts[0]));
  if (limit.warn > limit.fail)
    throw std::invalid_argument(fmt::format("in '{}' the warn limit exceeds the fail limit", text));
  if (limit.allowed_fraction > 1.0)
    throw std::invalid_argument(fmt::format("in '{}' the outliers exceed 1", text));
  return limit;
}

LimitResult apply_limit(const Limit& limit, const DifferenceMap& map,
                        const DifferenceStatistics& statistics,
                        std::span<const MetricMap> metrics) {
  if (const auto scale = scale_of(limit.quantity)) {
    const DifferenceGate gate =
        apply_limits(map, {*scale, limit.warn, limit.fail, limit.allowed_fraction});
    const char* units[] = {"", "1", "%", "sigma"};
    return {limit,
            gate.outcome,
            true,
            gate.largest,
            *scale == DifferenceScale::absolute ? map.unit : units[static_cast<int>(*scale)],
            gate.largest_at,
            gate.pixels,
            gate.pixels_over_warn,
            gate.pixels_over_fail,
            gate.pixels_not_finite};
  }
  for (const Whole& whole : kWholes)
    if (limit.quantity == whole.name) {
      LimitResult r =
          of_whole(limit, statistics.*whole.value, whole.has_unit ? map.unit : std::string("1"));
      r.not_finite = statistics.not_finite;
      if (r.not_finite > 0) r.outcome = Agreement::fails;
      return r;
    }
  if (!limit.quantity.ends_with("-mean"))
    return of_metric(limit, metric(metrics, limit.quantity), map);
  const MetricMap& chosen = metric(metrics, limit.quantity.substr(0, limit.quantity.size() - 5));
  const MetricSummary summary = metric_summary(chosen, map.mask);
  LimitResult r = of_whole(limit, summary.mean, chosen.unit);
  r.not_finite = summary.not_finite;
  if (r.not_finite > 0) r.outcome = Agreement::fails;
  return r;
}

}  // namespace truebox

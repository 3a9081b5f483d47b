// SPDX-License-Identifier: BSD-3-Clause
#include "figures/axis.h"

#include <algorithm>
#include <cmath>

#include "figures/text.h"

namespace truebox {
namespace {

/// The largest of 1, 2, 5 x 10^k that cuts the span into at least four parts.
double tick_step(double span) {
  const double rough = span / 4.0;
  const double decade = std::pow(10.0, std::floor(std::log10(rough)));
  for (double factor : {5.0, 2.0, 1.0})
    if (factor * decade <= rough * (1.0 + 1e-9)) return factor * decade;
  return decade;
}

/// 10⁻⁴ also where a plain number would do, so that one axis has one form.
std::string power_text(double tick) {
  const double exponent = std::floor(std::log10(tick) + 1e-9);
  const auto mantissa = std::lround(tick / std::pow(10.0, exponent));  // 1, 2 or 5
  const std::string power = unit_text("10^" + std::to_string(static_cast<int>(exponent)));
  return mantissa == 1 ? power : std::to_string(mantissa) + " × " + power;
}

}  // namespace

AxisScale::AxisScale(ValueRange range, bool logarithmic, double from_paper, double to_paper)
    : range_(range), logarithmic_(logarithmic), from_(from_paper), to_(to_paper) {
  if (logarithmic_) {
    const double first = std::floor(std::log10(range.low) + 1e-9);
    const double decades = std::log10(range.high / range.low);
    const double every = std::max(1.0, std::ceil(decades / 6.0));
    for (double e = first; e <= std::log10(range.high) + 1e-9; e += every)
      for (double factor : {1.0, 2.0, 5.0}) {
        const double tick = factor * std::pow(10.0, e);
        const bool inside = tick >= range.low * (1 - 1e-9) && tick <= range.high * (1 + 1e-9);
        if (inside && (factor == 1.0 || decades < 2.0)) ticks_.push_back(tick);
      }
    return;
  }
  const double step = tick_step(range.high - range.low);
  decimals_ = std::max(0, static_cast<int>(-std::floor(std::log10(step) + 1e-9)));
  const double first = std::ceil(range.low / step - 1e-9);
  for (int i = 0; (first + i) * step <= range.high + 1e-9 * step; ++i)
    ticks_.push_back((first + i) * step + 0.0);
}

ValueRange AxisScale::nice_range(ValueRange data, bool logarithmic) {
  if (logarithmic) {
    const double low = std::pow(10.0, std::floor(std::log10(data.low) + 1e-9));
    const double high = std::pow(10.0, std::ceil(std::log10(data.high) - 1e-9));
    return {low, high > low ? high : 10.0 * low};
  }
  if (!(data.high > data.low)) {
    const double margin = data.low == 0.0 ? 1.0 : 0.5 * std::abs(data.low);
    return {data.low - margin, data.low + margin};
  }
  const double step = tick_step(data.high - data.low);
  return {std::floor(data.low / step + 1e-9) * step, std::ceil(data.high / step - 1e-9) * step};
}

double AxisScale::operator()(double value) const {
  const double t = logarithmic_ ? std::log(value / range_.low) / std::log(range_.high / range_.low)
                                : (value - range_.low) / (range_.high - range_.low);
  return from_ + t * (to_ - from_);
}

bool AxisScale::shows(double value) const {
  const double slack = 1e-9 * (range_.high - range_.low);
  return std::isfinite(value) && (!logarithmic_ || value > 0.0) && value >= range_.low - slack &&
         value <= range_.high + slack;
}

std::string AxisScale::tick_label(double tick) const {
  const double largest = std::max(std::abs(range_.low), std::abs(range_.high));
  if (logarithmic_ && range_.low > 0.99e-3 && range_.high < 1.01e4) return number_text(tick, 1);
  if (logarithmic_) return power_text(tick);
  if (largest >= 1e6 || decimals_ > 5) return number_text(tick, 3);
  return fixed_text(tick, decimals_);
}

std::string axis_title(const Axis& axis) {
  const std::string unit = unit_text(axis.unit);
  return xml_escape(unit.empty() ? axis.quantity : axis.quantity + " / " + unit);
}

}  // namespace truebox

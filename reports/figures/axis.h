// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "figures/false_colour.h"

namespace truebox {

/// An axis says what it shows and in which unit: "wavelength", "nm".
struct Axis {
  std::string quantity;
  std::string unit;
  bool logarithmic = false;           ///< values must then be positive; others are left out
  std::optional<ValueRange> range{};  ///< found from the data if not given
};

/// Where values land on paper (SVG user units), and the round numbers to label.
class AxisScale {
 public:
  AxisScale(ValueRange range, bool logarithmic, double from_paper, double to_paper);

  /// A rounded-out range for data in [low, high].
  static ValueRange nice_range(ValueRange data, bool logarithmic);

  double operator()(double value) const;  ///< position; may lie outside the paper
  bool shows(double value) const;         ///< finite, inside the range
  const std::vector<double>& ticks() const { return ticks_; }
  std::string tick_label(double tick) const;

 private:
  ValueRange range_;
  bool logarithmic_;
  double from_, to_;
  int decimals_ = 0;
  std::vector<double> ticks_;
};

/// "quantity / unit", escaped for SVG; the quantity alone where the unit is 1.
std::string axis_title(const Axis& axis);

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

namespace truebox {

/// The text with every byte that is no UTF-8, and every control character that XML 1.0 forbids,
/// replaced by U+FFFD. Text from outside may hold anything; JSON and XML may not.
std::string valid_text(std::string_view text);

/// `valid_text`, then & < > " ' as entities: safe in HTML and XML content and in quoted attributes.
std::string xml_escape(std::string_view text);

/// A number for people: `digits` significant digits, powers of ten written out ("1.2 × 10⁻⁵"),
/// "NaN" and "±∞" spelled. Trailing zeros are kept: they say how well the number is known.
std::string number_text(double value, int digits = 4);

/// With a fixed number of decimals, for columns that line up.
std::string fixed_text(double value, int decimals);

/// "0.5123 ± 0.0012": the uncertainty to two significant digits, the value to the same decimals
/// (JCGM 100:2008, 7.2.6). Without a positive uncertainty: `number_text(value, digits)`.
std::string estimate_text(double value, double standard_uncertainty, int digits = 4);

/// "unit" as it follows a number or an axis name: "" for dimensionless (empty or "1"), and
/// "W m^-2 nm^-1" becomes "W m⁻² nm⁻¹".
std::string unit_text(const std::string& unit);

}  // namespace truebox

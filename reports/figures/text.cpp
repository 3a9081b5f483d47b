// SPDX-License-Identifier: BSD-3-Clause
#include "figures/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace truebox {
namespace {

constexpr const char* kReplacement = "\xEF\xBF\xBD";  // U+FFFD
constexpr const char* kSuperscripts[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};

/// Length of the well-formed UTF-8 sequence at the front (Unicode 15, table 3-7), 0 if there is
/// none.
std::size_t sequence_length(std::string_view s) {
  const auto byte = [&](std::size_t i) {
    return i < s.size() ? static_cast<std::uint8_t>(s[i]) : std::uint8_t{0};
  };
  const auto tail = [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i)
      if ((byte(i) & 0xC0) != 0x80) return false;
    return true;
  };
  const std::uint8_t a = byte(0), b = byte(1);
  if (a < 0x80) return 1;
  if (a >= 0xC2 && a <= 0xDF) return tail(1, 2) ? 2 : 0;
  if (a >= 0xE0 && a <= 0xEF) {
    if ((a == 0xE0 && b < 0xA0) || (a == 0xED && b > 0x9F)) return 0;
    return tail(1, 3) ? 3 : 0;
  }
  if (a >= 0xF0 && a <= 0xF4) {
    if ((a == 0xF0 && b < 0x90) || (a == 0xF4 && b > 0x8F)) return 0;
    return tail(1, 4) ? 4 : 0;
  }
  return 0;
}

std::string superscript(std::string_view digits) {
  std::string text;
  for (char c : digits) {
    if (c == '-') text += "⁻";
    if (c >= '0' && c <= '9') text += kSuperscripts[c - '0'];
  }
  return text;
}

std::string special_text(double value) {
  if (std::isnan(value)) return "NaN";
  return value > 0.0 ? "+∞" : "-∞";
}

}  // namespace

std::string valid_text(std::string_view text) {
  std::string result;
  while (!text.empty()) {
    const std::size_t length = sequence_length(text);
    const auto first = static_cast<std::uint8_t>(text.front());
    const bool control = (first < 0x20 && first != '\n' && first != '\t') || first == 0x7F;
    const bool forbidden = text.starts_with("\xEF\xBF\xBE") || text.starts_with("\xEF\xBF\xBF");
    if (length == 0 || control || forbidden) {
      result += kReplacement;
    } else {
      result += text.substr(0, length);
    }
    text.remove_prefix(length == 0 ? 1 : length);
  }
  return result;
}

std::string xml_escape(std::string_view text) {
  std::string result;
  for (char c : valid_text(text)) {
    switch (c) {
      case '&': result += "&amp;"; break;
      case '<': result += "&lt;"; break;
      case '>': result += "&gt;"; break;
      case '"': result += "&quot;"; break;
      case '\'': result += "&#39;"; break;
      default: result += c;
    }
  }
  return result;
}

std::string number_text(double value, int digits) {
  if (!std::isfinite(value)) return special_text(value);
  if (value == 0.0) return "0";
  // printf's rule for %g, but whole numbers of up to six digits are never written with an exponent.
  const auto scientific = fmt::format("{:.{}e}", value, digits - 1);
  const std::size_t e = scientific.find('e');
  const int exponent = std::stoi(scientific.substr(e + 1));
  if (exponent < -4 || exponent >= std::max(digits, 6)) {
    const std::string mantissa = scientific.substr(0, e);
    if (mantissa == "1") return "10" + superscript(std::to_string(exponent));
    return mantissa + " × 10" + superscript(std::to_string(exponent));
  }
  return fmt::format("{:.{}f}", value, std::max(0, digits - 1 - exponent));
}

std::string fixed_text(double value, int decimals) {
  if (!std::isfinite(value)) return special_text(value);
  std::string text = fmt::format("{:.{}f}", value, decimals);
  if (text.starts_with('-') && text.find_first_of("123456789") == text.npos) text.erase(0, 1);
  return text;  // a rounded-away "-0.00" would claim a sign that is not known
}

std::string estimate_text(double value, double standard_uncertainty, int digits) {
  const double u = standard_uncertainty;
  if (!std::isfinite(value) || !std::isfinite(u) || u <= 0.0) return number_text(value, digits);
  const int decimals = 1 - static_cast<int>(std::floor(std::log10(u)));
  if (decimals < 0 || decimals > 8) return number_text(value, digits) + " ± " + number_text(u, 2);
  return fixed_text(value, decimals) + " ± " + fixed_text(u, decimals);
}

std::string unit_text(const std::string& unit) {
  if (unit == "1") return "";
  std::string text;
  for (std::size_t i = 0; i < unit.size(); ++i) {
    if (unit[i] != '^') {
      text += unit[i];
      continue;
    }
    std::size_t end = i + 1;
    while (end < unit.size() && (unit[end] == '-' || (unit[end] >= '0' && unit[end] <= '9'))) ++end;
    text += superscript(std::string_view(unit).substr(i + 1, end - i - 1));
    i = end - 1;
  }
  return text;
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "planning/plan_text.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace truebox::plan_text {
namespace {

std::string number(double value, const char* unit) {
  char text[64];
  std::snprintf(text, sizeof text, "%.2g%s", value, unit);
  return text;
}

}  // namespace

std::string percent(double share) { return number(100.0 * share, " %"); }
std::string seconds(double s) { return number(s, " s"); }
std::string mebibytes(double bytes) {
  return std::to_string(std::llround(std::min(bytes, 1e18) / (1 << 20))) + " MiB";
}
std::string count(double n) { return std::to_string(std::llround(std::min(n, 1e18))); }
std::string count(std::size_t n) { return std::to_string(n); }

}  // namespace truebox::plan_text

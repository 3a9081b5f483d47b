// SPDX-License-Identifier: BSD-3-Clause
#include "uncertainty/significance.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace truebox {

double two_sided_p(double t, int degrees) {
  if (std::isnan(t)) return 0.0;
  if (degrees <= 0) return std::erfc(std::abs(t) / std::numbers::sqrt2);
  const double theta = std::atan(std::abs(t) / std::sqrt(degrees));
  const double c = std::cos(theta), s = std::sin(theta);
  const bool is_odd = degrees % 2 == 1;
  double sum = 0.0, term = is_odd ? c : 1.0;
  for (int k = is_odd ? 3 : 2; k <= degrees; k += 2) {
    sum += term;
    term *= c * c * (k - 1) / k;
  }
  const double within = is_odd ? 2.0 / std::numbers::pi * (theta + s * sum) : s * sum;
  return std::clamp(1.0 - within, 0.0, 1.0);
}

double normal_score(double p) {
  double low = 0.0, high = 8.3;
  for (int step = 0; step < 48; ++step) {
    const double middle = 0.5 * (low + high);
    (two_sided_p(middle) > p ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

double family_wise_p(double smallest_p, std::size_t count) {
  return -std::expm1(static_cast<double>(count) * std::log1p(-std::min(smallest_p, 1.0 - 1e-16)));
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "uncertainty/distributions.h"

#include <algorithm>
#include <boost/math/special_functions/beta.hpp>
#include <boost/math/special_functions/erf.hpp>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace truebox {

double normal_two_sided_tail(double z) { return std::erfc(std::abs(z) / std::numbers::sqrt2); }

double normal_two_sided_quantile(double p) {
  if (!(p > 0.0 && p <= 1.0)) throw std::invalid_argument("a probability must lie in (0, 1]");
  return std::numbers::sqrt2 * boost::math::erfc_inv(p);
}

double chi_squared_upper_tail(double chi_squared, double degrees_of_freedom) {
  if (!(degrees_of_freedom > 0.0) || std::isnan(chi_squared))
    throw std::invalid_argument("chi^2 needs degrees of freedom and a number");
  if (std::isinf(chi_squared)) return 0.0;
  const double a = degrees_of_freedom / 2.0, x = std::max(chi_squared, 0.0) / 2.0;
  // Boost overflows far below the mean of many degrees of freedom (identical images). There the
  // lower tail is at most exp(a - x + a ln(x / a)) (Chernoff 1952): below 2^-53 it is 1 - 0.
  if (x == 0.0 || (x < a && a - x + a * std::log(x / a) < -40.0)) return 1.0;
  return boost::math::gamma_q(a, x);
}

double binomial_upper_tail(std::size_t count, std::size_t trials, double probability) {
  if (!(probability >= 0.0 && probability <= 1.0))
    throw std::invalid_argument("a probability must lie in [0, 1]");
  if (count == 0) return 1.0;
  if (count > trials || probability == 0.0) return 0.0;
  const auto k = static_cast<double>(count), n = static_cast<double>(trials);
  return boost::math::ibeta(k, n - k + 1.0, probability);  // Abramowitz & Stegun 26.5.24
}

std::size_t binomial_upper_limit(std::size_t trials, double probability, double level) {
  std::size_t low = 0, high = trials;  // P(X > high) = 0 <= level
  while (low < high) {
    const std::size_t middle = low + (high - low) / 2;
    if (binomial_upper_tail(middle + 1, trials, probability) <= level)
      high = middle;
    else
      low = middle + 1;
  }
  return low;
}

double normal_score_of_student_t(double t, double degrees_of_freedom) {
  const double nu = degrees_of_freedom;
  if (!(nu >= 1.0)) throw std::invalid_argument("Student's t needs one degree of freedom");
  if (std::isinf(nu) || std::isinf(t)) return t;
  const double z = (8.0 * nu + 1.0) / (8.0 * nu + 3.0) * std::sqrt(nu * std::log1p(t * t / nu));
  return std::copysign(z, t);
}

double sidak_level(double level, std::size_t comparisons) {
  if (!(level > 0.0 && level < 1.0)) throw std::invalid_argument("a level must lie in (0, 1)");
  if (comparisons == 0) return level;
  return -std::expm1(std::log1p(-level) / static_cast<double>(comparisons));
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

namespace truebox {

/// P(|Z| > z) of a standard normal Z.
double normal_two_sided_tail(double z);

/// The z with P(|Z| > z) = p; p in (0, 1], else std::invalid_argument.
double normal_two_sided_quantile(double p);

/// P(X > chi_squared) of a chi^2 distribution with `degrees_of_freedom` > 0.
double chi_squared_upper_tail(double chi_squared, double degrees_of_freedom);

/// P(X >= count) of a binomial distribution.
double binomial_upper_tail(std::size_t count, std::size_t trials, double probability);

/// The largest count that a binomial distribution exceeds with a probability of at most `level`.
std::size_t binomial_upper_limit(std::size_t trials, double probability, double level);

/// The normal score as far out as Student's t with nu >= 1 degrees of freedom, with t's sign:
/// z = (8 nu + 1) / (8 nu + 3) sqrt(nu ln(1 + t^2 / nu)). Never underflows. Down to tails of 1e-6
/// within 0.06 for nu >= 3 and 0.03 for nu >= 7. Source: Wallace (1959), Ann. Math. Stat. 30(4).
double normal_score_of_student_t(double t, double degrees_of_freedom);

/// The level for each of `comparisons` independent tests that keeps all of them at `level`:
/// 1 - (1 - level)^(1 / n). Source: Sidak (1967), J. Am. Stat. Assoc. 62(318).
double sidak_level(double level, std::size_t comparisons);

}  // namespace truebox

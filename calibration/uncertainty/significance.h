// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

namespace truebox {

/// Probability that |T| exceeds |t| by chance, T of Student's distribution with `degrees` >= 1
/// degrees of freedom; 0 or less stands for a normal distribution. Absolute error 1e-15.
/// Source: Abramowitz & Stegun (1964), 26.7.3 and 26.7.4.
double two_sided_p(double t, int degrees = 0);

/// The |z| of a normal distribution whose two-sided p-value this is, at most 8.3 (p = 1e-16).
double normal_score(double p);

/// Probability that the smallest of `count` independent p-values is as small by chance. Source:
/// Sidak (1967).
double family_wise_p(double smallest_p, std::size_t count);

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "uncertainty/coverage.h"

#include <cmath>

namespace truebox {

Coverage coverage(std::size_t hits, std::size_t trials, double z) {
  if (trials == 0) return {};
  const double n = static_cast<double>(trials), p = static_cast<double>(hits) / n;
  const double centre = (p + z * z / (2.0 * n)) / (1.0 + z * z / n);
  const double half = z / (1.0 + z * z / n) * std::sqrt(p * (1.0 - p) / n + z * z / (4.0 * n * n));
  return {p, centre - half, centre + half};
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "verification/accuracy_check.h"

#include <algorithm>
#include <cmath>

namespace truebox {

bool AccuracyCheck::passed() const { return std::abs(computed - certified) <= allowed; }

double matching_digits(double computed, double certified) {
  if (!std::isfinite(computed) || !std::isfinite(certified)) return 0.0;
  const double scale = certified == 0.0 ? 1.0 : std::abs(certified);
  const double error = std::abs(computed - certified) / scale;
  return error == 0.0 ? 16.0 : std::clamp(-std::log10(error), 0.0, 16.0);
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "uncertainty/en_score.h"

#include <cmath>
#include <limits>

namespace truebox {

EnScore en_score(const Estimate& measured, const Estimate& reference) {
  const double difference = measured.value - reference.value;
  const double expanded =
      kCoverageFactor * std::hypot(measured.standard_uncertainty, reference.standard_uncertainty);
  if (expanded > 0.0) return {difference / expanded};
  if (difference == 0.0) return {0.0};
  return {std::copysign(std::numeric_limits<double>::infinity(), difference)};
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "transport/legendre.h"

#include <array>
#include <cmath>

namespace truebox {

void legendre(double t, int degree, double* values) {
  static const auto kScale = [] {
    std::array<double, kMaxDegree + 1> scale{};
    for (int k = 0; k <= kMaxDegree; ++k) scale[k] = std::sqrt(2.0 * k + 1.0);
    return scale;
  }();
  const double x = 2.0 * t - 1.0;
  double before = 0.0, now = 1.0;
  for (int k = 0; k <= degree; ++k) {
    values[k] = kScale[k] * now;
    const double next = ((2 * k + 1) * x * now - k * before) / (k + 1);
    before = now;
    now = next;
  }
}

}  // namespace truebox

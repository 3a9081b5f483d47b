// SPDX-License-Identifier: BSD-3-Clause
#include "transport/quadrature.h"

#include <cmath>
#include <numbers>

namespace truebox {
namespace {

GaussRule make_rule(int n) {
  GaussRule rule;
  for (int i = 0; i < n; ++i) {
    double x = std::cos(std::numbers::pi * (i + 0.75) / (n + 0.5)), slope = 1.0;
    for (int step = 0; step < 100; ++step) {
      double p0 = 1.0, p1 = x;
      for (int k = 2; k <= n; ++k) {
        const double p2 = ((2 * k - 1) * x * p1 - (k - 1) * p0) / k;
        p0 = p1;
        p1 = p2;
      }
      slope = n * (x * p1 - p0) / (x * x - 1.0);
      const double change = p1 / slope;
      x -= change;
      if (std::abs(change) < 1e-16) break;
    }
    rule.nodes[i] = 0.5 * (1.0 - x);
    rule.weights[i] = 1.0 / ((1.0 - x * x) * slope * slope);
  }
  return rule;
}

}  // namespace

const GaussRule& gauss_rule(int points) {
  static const auto rules = [] {
    std::array<GaussRule, kMaxGaussPoints + 1> all;
    for (int n = 1; n <= kMaxGaussPoints; ++n) all[n] = make_rule(n);
    return all;
  }();
  return rules[points];
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

namespace truebox {

inline constexpr int kMaxGaussPoints = 16;

/// Gauss-Legendre rule on [0, 1]: `points` nodes, weights that sum to 1, exact to degree
/// 2 points - 1.
struct GaussRule {
  std::array<double, kMaxGaussPoints> nodes{};
  std::array<double, kMaxGaussPoints> weights{};
};

/// 1 <= points <= kMaxGaussPoints. Nodes by Newton's method on P_n (Press et al. 2007, 4.6).
const GaussRule& gauss_rule(int points);

}  // namespace truebox

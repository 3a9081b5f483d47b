// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "hierarchy/group_basis.h"
#include "hierarchy/group_kernel.h"

namespace truebox {

/// The kernel between two flat groups as polynomials on their rectangles, nothing between:
///   k(x, y) = sum_kl c_kl phi_k(x) phi_l(y), m^-2, k and l up to a total degree,
/// by projection from 4 x 4 Gauss points of each. What a degree leaves out is the rest of the 16 x
/// 16 products (Parseval), and at the highest degree the next one as the last two foretell.
struct KernelFit {
  float coefficient_per_m2[16][16];  ///< terms of a x terms of b, by total degree
  std::array<KernelStatistics, kMaxLinkDegree + 1> of_degree;  ///< mean, and the spreads left out

  /// What is to be left of all terms but the constant so that the polynomial is nowhere negative,
  /// corners included: 1 in most cases. Its mean stays.
  double damping(int degree) const;
};

KernelFit fit_kernel(const GroupFrame& a, const Vec3& normal_a, const GroupFrame& b,
                     const Vec3& normal_b);

}  // namespace truebox

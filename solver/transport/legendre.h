// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace truebox {

inline constexpr int kMaxDegree = 15;

/// Legendre polynomials orthonormal on [0, 1]: values[k] = sqrt(2 k + 1) P_k(2 t - 1) for
/// k = 0..degree <= kMaxDegree.
void legendre(double t, int degree, double* values);

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "radiometry/estimate.h"

namespace truebox {

/// Coverage factor of expanded uncertainties, about 95 % for a normal distribution.
inline constexpr double kCoverageFactor = 2.0;

/// E_n = (x - ref) / sqrt(U^2 + U_ref^2), U = k u, k = 2; |E_n| <= 1 agrees.
/// Signed, so that a table shows which way a laboratory errs. Holds for independent x and ref.
/// Source: ISO 13528:2022, 9.7; ISO/IEC 17043:2010, B.3.1.
struct EnScore {
  double value = 0.0;
  bool agrees() const { return value >= -1.0 && value <= 1.0; }
};

/// Two uncertainties of zero agree only if the values are equal (else an infinite score).
EnScore en_score(const Estimate& measured, const Estimate& reference);

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "radiometry/estimate.h"

namespace truebox {

/// A value measured and the same value from a reference, each with the u that its budget gives.
struct ComparedPair {
  Estimate measured, reference;
};

/// What a budget lacks where fewer pairs agree than k = 2 promises (95 %), and what kind of
/// contribution it is. Nothing of this may be added to a budget: sized on the readings that it
/// would explain, it makes them agree by construction.
struct MissingContribution {
  std::size_t pairs = 0, agreeing = 0;  ///< |E_n| <= 1
  std::size_t low = 0, low_misses = 0, misses = 0;
  double additive_u = 0.0;  ///< further u of every pair that would let 95 % agree; 0: none needed
  double relative_u = 0.0;  ///< the same, relative to the reference
  /// measured - reference = offset + slope * reference, least squares with the pairs' own u. An
  /// offset is light that should not be there, or is missing; a slope a wrong scale.
  Estimate offset, slope;

  bool is_missing() const { return additive_u > 0.0; }
  /// "agreement is 120 of 126: nothing is missing", or how much is, which way readings err and
  /// what kind of contribution would do that.
  std::string in_words() const;
};

MissingContribution missing_contribution(const std::vector<ComparedPair>& pairs);

}  // namespace truebox

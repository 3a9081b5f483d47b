// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

namespace truebox {

/// How often an interval held the truth, with the range that this many trials leave open.
struct Coverage {
  double fraction = 0.0;
  double low = 0.0;  ///< Wilson score interval
  double high = 1.0;
};

/// Wilson score interval for `hits` of `trials` at z standard deviations (2: about 95 %).
/// Source: Wilson (1927), J. Am. Stat. Assoc. 22(158).
Coverage coverage(std::size_t hits, std::size_t trials, double z = 2.0);

}  // namespace truebox

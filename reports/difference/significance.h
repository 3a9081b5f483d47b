// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "difference/agreement.h"
#include "difference/difference_statistics.h"

namespace truebox {

struct SignificanceOptions {
  double coverage_factor = 2.0;   ///< k: beyond it a difference stands out
  double level = 0.01;            ///< how often images that agree may be said not to
  double allowed_fraction = 0.0;  ///< of the pixels that may stand out besides those by chance
};

/// Counts in bins of z: seen, and expected of a standard normal distribution.
struct ScoreBin {
  double from = 0.0, to = 0.0;  ///< the outermost are open
  std::size_t seen = 0;
  double expected = 0.0;
};

/// What is left of the differences once their uncertainties are taken into account.
///
/// Among a million pixels that agree, 45500 lie beyond k = 2 by chance. So two questions are asked
/// of all pixels as a family. Do more stand out than chance explains? (binomial; fails the gate.)
/// Does one stand out that even a family of this size should not hold? (Sidak; warns: a single
/// pixel does not fail a million.) A pixel counts by its worst channel, its k widened for their
/// number, which is exact for independent channels and on the safe side for correlated ones.
/// Samples that are equal and have u = 0 (both black) are left out: chance could not have moved
/// them. Pixels are taken as independent of each other; a shared calibration error makes them less
/// so.
struct Significance {
  SignificanceOptions options;
  std::size_t pixels = 0;
  std::size_t not_finite = 0;        ///< pixels without a score: they fail, whatever the rest
  double chi_squared = 0.0;          ///< over all samples
  double degrees_of_freedom = 0.0;   ///< the number of samples
  double chi_squared_p = 0.0;        ///< chance of a larger one
  double mean_z = 0.0, rms_z = 0.0;  ///< 0 and 1 expected
  double beyond_limit = 0.0;         ///< |z| of the worst channel that a pixel exceeds to stand out
  std::size_t beyond = 0, beyond_allowed = 0;
  double beyond_expected = 0.0;  ///< by chance, allowed fraction included
  double beyond_p = 0.0;         ///< chance of so many or more
  double farthest = 0.0;         ///< largest |z|
  double farthest_limit = 0.0;   ///< exceeded in the whole family with a chance of `level`
  double farthest_p = 0.0;       ///< chance of one as far, in the whole family
  SamplePosition farthest_at;
  std::vector<ScoreBin> histogram;  ///< all samples, bins of 0.5 from -4 to 4 and the tails
  Agreement outcome = Agreement::not_run;
};

/// Throws std::invalid_argument if the map has no uncertainty or an option is out of range.
Significance significance(const DifferenceMap& map, const SignificanceOptions& options = {});

}  // namespace truebox

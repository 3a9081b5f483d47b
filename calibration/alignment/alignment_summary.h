// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace truebox {

/// How an alignment ended. Pessimistic until proven; what mathematics or the picture refuses is a
/// value, not an exception.
enum class AlignmentOutcome {
  not_run,
  invalid_problem,  ///< nothing to align: no edge in view, too few corners
  no_such_box,      ///< the picture does not show what the scene predicts
  not_converged,
  rank_deficient,  ///< a combination of parameters is not determined; the null direction names it
  contradiction,   ///< light and edges tell of different cameras
  converged,
};

std::string to_string(AlignmentOutcome outcome);

/// A parameter with its standard uncertainty; `prior_u` is what was known before (infinite:
/// nothing).
struct EstimatedParameter {
  std::string name, unit;
  double value = 0.0;
  double standard_uncertainty = 0.0;
  double prior_u = 0.0;
};

}  // namespace truebox

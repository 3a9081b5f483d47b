// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>

namespace truebox {

/// How a fit ended. Pessimistic until proven; mathematics that fails is a value, not an exception.
enum class Outcome {
  not_run,
  invalid_problem,  ///< the options or the data cannot be fitted; `message` says why
  not_converged,
  rank_deficient,  ///< a combination of parameters is not determined; see `null_direction`
  converged,
};

std::string to_string(Outcome outcome);

/// What a fit did, in numbers.
struct FitSummary {
  Outcome outcome = Outcome::not_run;
  std::string message;
  int iterations = 0;
  std::size_t observations = 0;
  std::size_t parameters = 0;
  double chi2 = 0.0;            ///< of the photograph's blocks, with their stated sigmas
  double chi2_per_dof = 0.0;    ///< above 1: the uncertainties were enlarged by its root
  double chi2_standards = 0.0;  ///< of the known standards about their values
  double condition = 0.0;       ///< of the column-scaled normal matrix
  std::string null_direction;   ///< the undetermined combination, by its largest terms

  bool usable() const { return outcome == Outcome::converged; }
  std::string brief() const;  ///< one line
  std::string full() const;   ///< everything above, one item a line
};

}  // namespace truebox

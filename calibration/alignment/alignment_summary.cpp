// SPDX-License-Identifier: BSD-3-Clause
#include "alignment/alignment_summary.h"

namespace truebox {

std::string to_string(AlignmentOutcome outcome) {
  switch (outcome) {
    case AlignmentOutcome::not_run: return "not run";
    case AlignmentOutcome::invalid_problem: return "invalid problem";
    case AlignmentOutcome::no_such_box: return "no such box";
    case AlignmentOutcome::not_converged: return "not converged";
    case AlignmentOutcome::rank_deficient: return "rank deficient";
    case AlignmentOutcome::contradiction: return "contradiction";
    case AlignmentOutcome::converged: return "converged";
  }
  return "unknown";
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "fit/fit_summary.h"

#include <sstream>

namespace truebox {

std::string to_string(Outcome outcome) {
  switch (outcome) {
    case Outcome::not_run: return "not run";
    case Outcome::invalid_problem: return "invalid problem";
    case Outcome::not_converged: return "not converged";
    case Outcome::rank_deficient: return "rank deficient";
    case Outcome::converged: return "converged";
  }
  return "unknown";
}

std::string FitSummary::brief() const {
  std::ostringstream text;
  text << to_string(outcome);
  if (!message.empty()) text << " (" << message << ")";
  if (!null_direction.empty()) text << ": " << null_direction;
  if (observations > 0)
    text << ", " << observations << " observations, " << parameters << " parameters, chi2/nu "
         << chi2_per_dof;
  return text.str();
}

std::string FitSummary::full() const {
  std::ostringstream text;
  text << "outcome          " << to_string(outcome) << "\n";
  if (!message.empty()) text << "message          " << message << "\n";
  if (!null_direction.empty()) text << "null direction   " << null_direction << "\n";
  text << "iterations       " << iterations << "\n"
       << "observations     " << observations << "\n"
       << "parameters       " << parameters << "\n"
       << "chi2             " << chi2 << "\n"
       << "chi2/nu          " << chi2_per_dof << "\n"
       << "chi2 standards   " << chi2_standards << "\n"
       << "condition        " << condition << "\n";
  return text.str();
}

}  // namespace truebox

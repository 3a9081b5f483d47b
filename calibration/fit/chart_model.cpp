// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "fit/chart_fit.h"

namespace truebox {

std::vector<double> field_terms(int order, double x, double y) {
  std::vector<double> terms;
  for (int degree = 1; degree <= order; ++degree)
    for (int j = 0; j <= degree; ++j) terms.push_back(std::pow(x, degree - j) * std::pow(y, j));
  return terms;
}

double ChartFit::illumination(double x, double y) const {
  const auto terms = field_terms(field_order, x, y);
  double sum = 1.0;
  for (std::size_t i = 0; i < terms.size(); ++i) sum += terms[i] * field[i];
  return sum;
}

std::optional<std::string> ChartFitOptions::invalid(const ChartProblem& problem) const {
  if (field_order < 0 || field_order > 6) return "field_order must be 0 to 6";
  if (max_iterations < 1) return "max_iterations must be at least 1";
  if (problem.patches.empty() || problem.standards.size() != problem.patches.size())
    return "every patch needs an entry in standards, known or not";
  std::vector<char> seen(problem.patches.size(), 0);
  for (const PatchBlock& b : problem.blocks) {
    if (b.patch >= problem.patches.size()) return "a block names a patch that is not there";
    if (!(b.standard_uncertainty > 0.0) || !std::isfinite(b.standard_uncertainty + b.value))
      return "a block of " + problem.patches[b.patch] + " needs a finite value and sigma > 0";
    seen[b.patch] = 1;
  }
  for (std::size_t p = 0; p < seen.size(); ++p) {
    if (!seen[p]) return "no usable photosite on patch " + problem.patches[p];
    const auto& known = problem.standards[p];
    if (known && !(known->standard_uncertainty > 0.0 && known->value >= 0.0))
      return "the standard " + problem.patches[p] + " needs a value >= 0 with u > 0";
  }
  return std::nullopt;
}

}  // namespace truebox

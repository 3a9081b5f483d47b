// SPDX-License-Identifier: BSD-3-Clause
#include "uncertainty/uncertainty_budget.h"

#include <cmath>
#include <stdexcept>

namespace truebox {

void UncertaintyBudget::add(std::string name, double standard_uncertainty) {
  if (!(standard_uncertainty >= 0.0) || !std::isfinite(standard_uncertainty))
    throw std::invalid_argument("contribution \"" + name +
                                "\" must be finite and not negative, is " +
                                std::to_string(standard_uncertainty));
  contributions_.push_back({std::move(name), standard_uncertainty});
}

double UncertaintyBudget::combined() const {
  double sum = 0.0;
  for (const auto& c : contributions_) sum += c.standard_uncertainty * c.standard_uncertainty;
  return std::sqrt(sum);
}

double UncertaintyBudget::of(const std::string& name) const {
  for (const auto& c : contributions_)
    if (c.name == name) return c.standard_uncertainty;
  return 0.0;
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace truebox {

/// One line of a budget: a standard uncertainty (k = 1) in the unit of the result, its sensitivity
/// coefficient already applied.
struct Contribution {
  std::string name;
  double standard_uncertainty = 0.0;
};

/// Independent contributions, combined in quadrature: u = sqrt(sum u_i^2).
/// Source: JCGM 100:2008 (GUM), 5.1.2.
class UncertaintyBudget {
 public:
  /// Throws std::invalid_argument if the uncertainty is negative or not finite.
  void add(std::string name, double standard_uncertainty);

  double combined() const;
  double of(const std::string& name) const;  ///< 0 if there is no such contribution
  const std::vector<Contribution>& contributions() const { return contributions_; }

 private:
  std::vector<Contribution> contributions_;
};

}  // namespace truebox

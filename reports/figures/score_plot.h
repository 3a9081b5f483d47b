// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <vector>

namespace truebox {

/// One score with the name of what was scored.
struct NamedScore {
  std::string name;
  double value = 0.0;
};

/// E_n scores as bars, one a row, with the limit |E_n| = 1 marked; those beyond it carry a cross
/// and another colour. Signed scores are drawn to both sides. Source: ISO 13528:2022, 9.7.
std::string en_score_svg(const std::string& title, const std::vector<NamedScore>& scores);

/// Histogram of z = (test - reference) / u in bins of 0.5, against the counts expected from N(0,
/// 1). |z| > 5 is gathered in the outermost bins; NaN is counted in the caption line, never
/// dropped.
std::string z_histogram_svg(const std::string& title, std::span<const double> z);

}  // namespace truebox

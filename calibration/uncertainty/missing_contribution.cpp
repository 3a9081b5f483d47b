// SPDX-License-Identifier: BSD-3-Clause
#include "uncertainty/missing_contribution.h"

#include <cmath>
#include <cstdio>

#include "uncertainty/distributions.h"
#include "uncertainty/en_score.h"

namespace truebox {
namespace {

constexpr double kPromised = 0.95;
constexpr double kSignificant = 3.0;  // u from 0
constexpr double kOneSided = 0.01;    // probability of so many of one sign by chance

std::size_t agreeing(const std::vector<ComparedPair>& pairs, double additive, double relative) {
  std::size_t n = 0;
  for (const ComparedPair& p : pairs) {
    const double more = std::hypot(additive, relative * p.reference.value);
    const Estimate measured{p.measured.value, std::hypot(p.measured.standard_uncertainty, more)};
    n += en_score(measured, p.reference).agrees();
  }
  return n;
}

/// The least further u with which so many agree, by bisection; `largest` is enough.
double least(const std::vector<ComparedPair>& pairs, std::size_t wanted, double largest,
             bool is_relative) {
  double low = 0.0, high = largest;
  for (int k = 0; k < 60; ++k) {
    const double middle = 0.5 * (low + high);
    const bool enough =
        agreeing(pairs, is_relative ? 0.0 : middle, is_relative ? middle : 0.0) >= wanted;
    (enough ? high : low) = middle;
  }
  return high;
}

void fit_line(const std::vector<ComparedPair>& pairs, MissingContribution& result) {
  double w = 0.0, x = 0.0, xx = 0.0, y = 0.0, xy = 0.0;
  for (const ComparedPair& p : pairs) {
    const double u = std::hypot(p.measured.standard_uncertainty, p.reference.standard_uncertainty);
    if (!(u > 0.0)) continue;
    const double weight = 1.0 / (u * u), d = p.measured.value - p.reference.value;
    w += weight;
    x += weight * p.reference.value;
    xx += weight * p.reference.value * p.reference.value;
    y += weight * d;
    xy += weight * p.reference.value * d;
  }
  const double determinant = w * xx - x * x;
  if (!(determinant > 0.0)) return;
  result.offset = {(xx * y - x * xy) / determinant, std::sqrt(xx / determinant)};
  result.slope = {(w * xy - x * y) / determinant, std::sqrt(w / determinant)};
}

std::string text(const char* format, double a, double b = 0.0) {
  char line[160];
  std::snprintf(line, sizeof line, format, a, b);
  return line;
}

}  // namespace

MissingContribution missing_contribution(const std::vector<ComparedPair>& pairs) {
  MissingContribution result;
  result.pairs = pairs.size();
  result.agreeing = agreeing(pairs, 0.0, 0.0);
  double largest = 0.0, smallest = 1e300;
  for (const ComparedPair& p : pairs) {
    const double d = p.measured.value - p.reference.value;
    const bool misses = !en_score(p.measured, p.reference).agrees();
    result.low += d < 0.0;
    result.misses += misses;
    result.low_misses += misses && d < 0.0;
    largest = std::max(largest, std::abs(d));
    if (p.reference.value > 0.0) smallest = std::min(smallest, p.reference.value);
  }
  fit_line(pairs, result);
  const auto wanted =
      static_cast<std::size_t>(std::ceil(kPromised * static_cast<double>(pairs.size())));
  if (result.agreeing >= wanted) return result;
  result.additive_u = least(pairs, wanted, largest, false);
  result.relative_u = least(pairs, wanted, largest / smallest, true);
  return result;
}

std::string MissingContribution::in_words() const {
  const std::string share = std::to_string(agreeing) + " of " + std::to_string(pairs) + " agree";
  if (!is_missing()) return share + ": at k = 2 no contribution is missing.";
  std::string words = share + ", fewer than the 95 % that k = 2 promises: the budget lacks " +
                      text("a standard uncertainty of %.2g (additive) or %.2g %% (relative).",
                           additive_u, 100.0 * relative_u);
  const std::size_t larger = std::max(low, pairs - low);
  const bool one_sided = 2.0 * binomial_upper_tail(larger, pairs, 0.5) < kOneSided;
  words += " Of the " + std::to_string(misses) + " that miss " + std::to_string(low_misses) +
           " read low, of all " + std::to_string(low) + ": " +
           (one_sided ? "errors of one sign, common to many readings, not scatter." : "scatter.");
  const bool offset_counts = std::abs(offset.value) > kSignificant * offset.standard_uncertainty;
  const bool slope_counts = std::abs(slope.value) > kSignificant * slope.standard_uncertainty;
  words += text(" Along the scale they differ by %+.4f +- %.4f", offset.value,
                offset.standard_uncertainty) +
           text(" and %+.2f +- %.2f %% of the value: ", 100.0 * slope.value,
                100.0 * slope.standard_uncertainty);
  if (offset_counts && !slope_counts)
    words += std::string("missing is an additive contribution, ") +
             (offset.value < 0.0 ? "light subtracted too much: black level or veil."
                                 : "light that does not belong there: veil, glare, black level.");
  else if (slope_counts && !offset_counts)
    words += "missing is a relative contribution: the scale of standards, gain or illumination.";
  else if (slope_counts)
    words += "missing are an additive contribution and one of the scale.";
  else if (one_sided)
    words +=
        "missing is a common contribution, and these readings do not tell an offset (black "
        "level, veil) from a scale (standards, illumination).";
  else
    words += "neither an offset nor a scale explains it; single readings do.";
  return words + " It is not added: sized on these readings it would make them agree.";
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "difference/significance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "uncertainty/distributions.h"

namespace truebox {
namespace {

constexpr double kBin = 0.5;
constexpr int kBins = 18;  // 16 from -4 to 4, and a tail on either side

std::vector<ScoreBin> empty_histogram() {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::vector<ScoreBin> bins(kBins);
  for (int b = 0; b < kBins; ++b) {
    const double from = -4.0 + kBin * (b - 1);
    bins[static_cast<std::size_t>(b)] = {from, from + kBin, 0, 0.0};
  }
  bins.front().from = -kInfinity;
  bins.back().to = kInfinity;
  return bins;
}

std::size_t bin_of(double z) {
  return static_cast<std::size_t>(std::clamp(std::floor((z + 4.0) / kBin) + 1.0, 0.0, kBins - 1.0));
}

double normal_below(double z) { return 0.5 * std::erfc(-z / std::sqrt(2.0)); }

void require_valid(const DifferenceMap& map, const SignificanceOptions& o) {
  if (!map.has_uncertainty())
    throw std::invalid_argument("differences in sigmas need an uncertainty for every channel");
  if (!(o.coverage_factor > 0.0 && o.level > 0.0 && o.level < 1.0 && o.allowed_fraction >= 0.0 &&
        o.allowed_fraction < 1.0))
    throw std::invalid_argument("k must be positive, level and allowed fraction inside (0, 1)");
}

}  // namespace

Significance significance(const DifferenceMap& map, const SignificanceOptions& options) {
  require_valid(map, options);
  Significance s;
  s.options = options;
  s.histogram = empty_histogram();
  const double by_chance = normal_two_sided_tail(options.coverage_factor);
  s.beyond_limit = normal_two_sided_quantile(sidak_level(by_chance, map.channels.size()));
  const auto all = static_cast<std::size_t>(map.width) * static_cast<std::size_t>(map.height);
  double sum = 0.0;
  for (std::size_t i = 0; i < all; ++i) {
    if (!map.counts(i)) continue;
    double worst = 0.0;
    bool known = true, compared = false;
    for (const auto& channel : map.channels) {
      // Equal and certain, like two black bands: nothing that chance could have moved.
      if (channel.difference[i] == 0.0f && channel.standard_uncertainty[i] == 0.0f) continue;
      compared = true;
      const double z = channel.score(i);
      if (std::isnan(z)) {
        known = false;
        continue;
      }
      s.degrees_of_freedom += 1.0;
      s.chi_squared += z * z;
      sum += z;
      ++s.histogram[bin_of(z)].seen;
      worst = std::max(worst, std::abs(z));
      if (std::abs(z) > s.farthest || s.farthest_at.channel.empty()) {
        const auto width = static_cast<std::size_t>(map.width);
        s.farthest = std::abs(z);
        s.farthest_at = {static_cast<int>(i % width), static_cast<int>(i / width), channel.name};
      }
    }
    s.pixels += compared;
    s.not_finite += !known;
    s.beyond += worst > s.beyond_limit;
  }
  const double n = s.degrees_of_freedom;
  if (n == 0.0) {  // equal everywhere without any doubt, or not known anywhere
    s.outcome = s.not_finite > 0 ? Agreement::fails : Agreement::agrees;
    return s;
  }
  s.mean_z = sum / n;
  s.rms_z = std::sqrt(s.chi_squared / n);
  s.chi_squared_p = chi_squared_upper_tail(s.chi_squared, n);
  for (ScoreBin& bin : s.histogram)
    bin.expected = n * (normal_below(bin.to) - normal_below(bin.from));
  const double probability = std::min(1.0, by_chance + options.allowed_fraction);
  s.beyond_expected = probability * static_cast<double>(s.pixels);
  s.beyond_allowed = binomial_upper_limit(s.pixels, probability, options.level);
  s.beyond_p = binomial_upper_tail(s.beyond, s.pixels, probability);
  const auto family = static_cast<std::size_t>(n);
  s.farthest_limit = normal_two_sided_quantile(sidak_level(options.level, family));
  s.farthest_p = -std::expm1(n * std::log1p(-std::min(1.0, normal_two_sided_tail(s.farthest))));
  s.outcome = s.farthest > s.farthest_limit ? Agreement::warning : Agreement::agrees;
  if (s.beyond > s.beyond_allowed || s.not_finite > 0) s.outcome = Agreement::fails;
  return s;
}

}  // namespace truebox

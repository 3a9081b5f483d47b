// SPDX-License-Identifier: BSD-3-Clause
#include "photometry/dark_distribution.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace truebox {
namespace {

constexpr std::size_t kFilled = 10;

double upper(double z) { return 0.5 * std::erfc(z / std::sqrt(2.0)); }
double density(double z) { return std::exp(-0.5 * z * z) / std::sqrt(2.0 * M_PI); }

/// Probability of a bin and its derivatives by mean and by log sigma.
std::array<double, 3> bin(std::size_t k, double mean, double sigma) {
  const double top = (static_cast<double>(k) + 0.5 - mean) / sigma;
  const double bottom = (static_cast<double>(k) - 0.5 - mean) / sigma;
  const double dt = density(top), db = k == 0 ? 0.0 : density(bottom);
  const double p = k == 0 ? 1.0 - upper(top) : upper(bottom) - upper(top);
  return {std::max(p, 1e-300), (db - dt) / sigma, (k == 0 ? 0.0 : db * bottom) - dt * top};
}

struct Score {
  double likelihood = 0.0, mean = 0.0, log_sigma = 0.0;
  double mm = 0.0, ms = 0.0, ss = 0.0;  // expected information
};

Score score_at(const std::vector<std::size_t>& counts, double n, double mean, double sigma) {
  Score s;
  const auto last = static_cast<std::size_t>(
      std::max(static_cast<double>(counts.size()), std::min(mean + 8.0 * sigma + 2.0, 1e6)));
  for (std::size_t k = 0; k < last; ++k) {
    const auto [p, dm, ds] = bin(k, mean, sigma);
    const double c = k < counts.size() ? static_cast<double>(counts[k]) : 0.0;
    if (c > 0.0) {
      s.likelihood += c * std::log(p);
      s.mean += c * dm / p;
      s.log_sigma += c * ds / p;
    }
    s.mm += n * dm * dm / p;
    s.ms += n * dm * ds / p;
    s.ss += n * ds * ds / p;
  }
  return s;
}

}  // namespace

DarkDistribution fit_dark_distribution(const std::vector<std::size_t>& counts,
                                       std::optional<double> known_sigma_dn) {
  DarkDistribution fit;
  double sum = 0.0, squares = 0.0;
  for (std::size_t k = 0; k < counts.size(); ++k) {
    const double c = static_cast<double>(counts[k]), v = static_cast<double>(k);
    fit.readings += counts[k];
    fit.filled_bins += counts[k] >= kFilled ? 1 : 0;
    sum += c * v;
    squares += c * v * v;
  }
  const bool both = !known_sigma_dn;
  if (fit.filled_bins < (both ? 3u : 2u) || (known_sigma_dn && !(*known_sigma_dn > 0.0)))
    return fit;
  const double n = static_cast<double>(fit.readings);
  double mean = sum / n;
  double sigma = both ? std::sqrt(std::max(squares / n - mean * mean, 0.05)) : *known_sigma_dn;
  Score s = score_at(counts, n, mean, sigma);
  for (int step = 0; step < 200; ++step) {  // Fisher scoring, halved until the likelihood rises
    double dm = s.mean / s.mm, ds = 0.0;
    if (both) {
      const double d = s.mm * s.ss - s.ms * s.ms;
      if (!(d > 1e-12 * s.mm * s.ss)) return fit;
      dm = (s.ss * s.mean - s.ms * s.log_sigma) / d;
      ds = std::clamp((s.mm * s.log_sigma - s.ms * s.mean) / d, -0.5, 0.5);
    }
    dm = std::clamp(dm, -2.0 * sigma, 2.0 * sigma);
    Score next;
    double share = 1.0;
    for (; share > 1e-6; share *= 0.5) {
      next = score_at(counts, n, mean + share * dm, sigma * std::exp(share * ds));
      if (next.likelihood >= s.likelihood) break;
    }
    if (!(share > 1e-6)) break;
    mean += share * dm;
    sigma *= std::exp(share * ds);
    s = next;
    if (std::abs(share * dm) < 1e-10 * sigma && std::abs(share * ds) < 1e-10) break;
  }
  if (both) {
    const double d = s.mm * s.ss - s.ms * s.ms;
    if (!(d > 1e-9 * s.mm * s.ss)) return fit;
    fit.mean_dn = {mean, std::sqrt(s.ss / d)};
    fit.sigma_dn = {sigma, sigma * std::sqrt(s.mm / d)};
    fit.correlation = -s.ms / std::sqrt(s.mm * s.ss);
  } else {
    fit.mean_dn = {mean, 1.0 / std::sqrt(s.mm)};
    fit.sigma_dn = {sigma, 0.0};
  }
  fit.found = true;
  return fit;
}

}  // namespace truebox

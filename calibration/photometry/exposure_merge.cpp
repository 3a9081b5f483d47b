// SPDX-License-Identifier: BSD-3-Clause
#include "photometry/exposure_merge.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "radiometry/input_error.h"

namespace truebox {
namespace {

/// +-1 DN, rectangular: what is known of a reading that the black level has swallowed.
constexpr double kClippedVariance_dn2 = 1.0 / 3.0;

struct Reading {
  double exposure_s, raw_dn, signal_dn, dark_variance_dn2;
  bool in_range;
  const MasterDark* dark;
};

struct Rate {
  double value = 0.0, variance = std::numeric_limits<double>::infinity();
  double effective_s = 0.0;
  std::size_t used = 0;
};

double variance_dn2(const Reading& reading, double expected_dn, const MergeOptions& options) {
  const double slope = options.response.slope(expected_dn);
  return (options.noise.variance_dn2(expected_dn) + reading.dark_variance_dn2) / (slope * slope);
}

Rate weighted_rate(const std::vector<Reading>& readings, const std::vector<char>& use, double guess,
                   const MergeOptions& options) {
  Rate rate;
  double top = 0.0, bottom = 0.0, over_t = 0.0, shared = 0.0, run = 0.0, run_squares = 0.0;
  const MasterDark* dark = nullptr;
  const auto close_run = [&] {  // frames of one exposure and its dark stand side by side
    shared += run * run - run_squares;
    run = run_squares = 0.0;
  };
  for (std::size_t i = 0; i < readings.size(); ++i) {
    if (!use[i]) continue;
    const double t = readings[i].exposure_s;
    const double expected = guess > 0.0 ? guess * t : readings[i].signal_dn;
    const double v = variance_dn2(readings[i], expected, options);
    top += t * readings[i].signal_dn / v;
    bottom += t * t / v;
    over_t += t / v;
    ++rate.used;
    if (readings[i].dark != dark) close_run();
    dark = readings[i].dark;
    const double slope = options.response.slope(expected);
    const double lever = t / v * std::sqrt(readings[i].dark_variance_dn2) / slope;
    run += lever;
    run_squares += lever * lever;
  }
  close_run();
  if (rate.used > 0)
    rate = {top / bottom, (1.0 + shared / bottom) / bottom, bottom / over_t, rate.used};
  return rate;
}

/// Marks readings whose expected value keeps three sigma from both ends of the range.
bool mark_expected(const std::vector<Reading>& readings, double guess, const MergeOptions& options,
                   std::vector<char>& use) {
  bool any = false;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    const double x = guess * readings[i].exposure_s;
    const double margin = 3.0 * std::sqrt(options.noise.variance_dn2(x));
    const double expected = options.response.reading_dn(x);
    use[i] = readings[i].raw_dn < options.saturation_dn &&
             expected < options.saturation_dn - margin && expected >= options.floor_dn;
    any = any || use[i];
  }
  return any;
}

Rate bound(const std::vector<Reading>& readings, const MergeOptions& options) {
  const Reading& longest = readings.back();
  const Reading& shortest = readings.front();
  const double t = longest.exposure_s;
  if (longest.raw_dn < options.saturation_dn)  // below the floor everywhere
    return {longest.signal_dn / t,
            (variance_dn2(longest, longest.signal_dn, options) + kClippedVariance_dn2) / (t * t), t,
            0};
  return {shortest.signal_dn / shortest.exposure_s, std::numeric_limits<double>::infinity(),
          shortest.exposure_s, 0};
}

Rate merge_photosite(const std::vector<Reading>& readings, const MergeOptions& options,
                     std::vector<char>& use) {
  bool any = false;
  for (std::size_t i = 0; i < readings.size(); ++i) any |= (use[i] = readings[i].in_range) != 0;
  if (!any) return bound(readings, options);
  Rate rate = weighted_rate(readings, use, 0.0, options);
  std::vector<char> expected(use.size());
  if (mark_expected(readings, rate.value, options, expected)) use = expected;
  for (int pass = 0; pass < 2; ++pass) rate = weighted_rate(readings, use, rate.value, options);
  return rate;
}

std::vector<const Frame*> by_exposure(const std::vector<Frame>& frames) {
  if (frames.empty()) throw std::invalid_argument("a merge needs at least one frame");
  std::vector<const Frame*> sorted;
  for (const Frame& frame : frames) {
    if (frame.image.width != frames[0].image.width || frame.image.height != frames[0].image.height)
      throw MismatchError(frame.path + ": a frame of another size");
    sorted.push_back(&frame);
  }
  std::sort(sorted.begin(), sorted.end(),
            [](const Frame* a, const Frame* b) { return a->exposure_s < b->exposure_s; });
  return sorted;
}

}  // namespace

MergeResult merge_exposures(const std::vector<Frame>& frames, const std::vector<MasterDark>& darks,
                            const BayerPattern& bayer, const MergeOptions& options) {
  const auto sorted = by_exposure(frames);
  const std::size_t pixels = sorted[0]->image.pixel_count(), count = sorted.size();
  MergeResult result;
  Photograph& photograph = result.photograph;
  photograph.width = sorted[0]->image.width;
  photograph.height = sorted[0]->image.height;
  photograph.bayer = bayer;
  photograph.shortest_s = sorted.front()->exposure_s;
  photograph.longest_s = sorted.back()->exposure_s;
  photograph.value.resize(pixels);
  photograph.variance.resize(pixels);
  photograph.exposures_used.resize(pixels);
  std::vector<const MasterDark*> dark(count);
  for (std::size_t i = 0; i < count; ++i) {
    dark[i] = matching_dark(darks, sorted[i]->exposure_s);
    if (dark[i] && dark[i]->mean_dn.size() != pixels)
      throw MismatchError("the dark frames have another size than " + sorted[i]->path);
    result.exposures_s.push_back(sorted[i]->exposure_s);
  }

  std::map<char, MergeOptions> of_site;
  for (const auto& [site, noise] : options.noise_of_site) {
    of_site[site] = options;
    of_site[site].noise = noise;
  }
  result.effective_s.resize(pixels);
  std::vector<Reading> readings(count);
  std::vector<char> use(count);
  std::vector<double> ratio(count, 0.0), weight(count, 0.0);
  double chi2 = 0.0;
  for (std::size_t p = 0; p < pixels; ++p) {
    for (std::size_t i = 0; i < count; ++i) {
      const double raw = sorted[i]->image.channels[0].samples[p];
      const double level = dark[i] ? double{dark[i]->mean_dn[p]} : 0.0;
      readings[i] = {sorted[i]->exposure_s,
                     raw,
                     options.response.linear_dn(raw - level),
                     dark[i] ? dark[i]->variance_at(p) : 0.0,
                     raw < options.saturation_dn && raw >= options.floor_dn,
                     dark[i]};
    }
    const int x = static_cast<int>(p % static_cast<std::size_t>(photograph.width));
    const int y = static_cast<int>(p / static_cast<std::size_t>(photograph.width));
    const auto own = of_site.find(bayer.site(x, y));
    const MergeOptions& site_options = own == of_site.end() ? options : own->second;
    const Rate rate = merge_photosite(readings, site_options, use);
    result.effective_s[p] = static_cast<float>(rate.effective_s);
    photograph.value[p] = static_cast<float>(rate.value);
    photograph.variance[p] = static_cast<float>(rate.variance);
    photograph.exposures_used[p] = static_cast<std::uint8_t>(rate.used);
    if (rate.used < 2 || (!options.linearity_mask.empty() && !options.linearity_mask[p])) continue;
    for (std::size_t i = 0; i < count; ++i) {
      if (!use[i]) continue;
      const double expected = rate.value * readings[i].exposure_s;
      const double v = variance_dn2(readings[i], expected, site_options);
      chi2 += std::pow(readings[i].signal_dn - expected, 2) / v;
      ratio[i] += expected * readings[i].signal_dn / v;
      weight[i] += expected * expected / v;
    }
    result.dof += rate.used - 1;
  }
  result.chi2_per_dof = result.dof > 0 ? chi2 / static_cast<double>(result.dof) : 0.0;
  for (std::size_t i = 0; i < count; ++i)
    result.mean_ratio.push_back(weight[i] > 0.0 ? ratio[i] / weight[i] : 0.0);
  return result;
}

}  // namespace truebox

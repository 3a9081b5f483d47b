// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "comparison.h"
#include "figures/text.h"
#include "uncertainty/distributions.h"

namespace truebox::app {
namespace {

/// "relative difference", "CIEDE2000 difference", "mean of flip".
std::string quantity_text(const LimitResult& r) {
  const std::string& q = r.limit.quantity;
  if (q == "absolute" || q == "sigmas") return "difference";
  if (q == "relative" || q == "percent") return "relative difference";
  if (q.ends_with("-mean")) return "mean of " + q.substr(0, q.size() - 5);
  return q;
}

void add_limit_checks(const LimitResult& r, std::vector<Check>& checks) {
  const std::string name = r.limit.quantity;
  if (!r.of_pixels) {
    const bool fails = r.outcome == Agreement::fails;
    checks.push_back(
        {name, r.outcome, r.measured, fails ? r.limit.fail : r.limit.warn, r.unit,
         fmt::format("warns beyond {:.4g}, fails beyond {:.4g}", r.limit.warn, r.limit.fail)});
    return;
  }
  const double allowed = r.limit.allowed_fraction * static_cast<double>(r.pixels);
  const auto add = [&](const char* which, std::size_t beyond, double limit, Agreement if_over) {
    const auto n = static_cast<double>(beyond);
    checks.push_back({fmt::format("{}: pixels over the {} limit", name, which),
                      n > allowed ? if_over : Agreement::agrees, n, allowed, "px",
                      fmt::format("limit {}, largest {} at {}", with_unit(limit, r.unit),
                                  with_unit(r.measured, r.unit), place(r.at))});
  };
  add("fail", r.beyond_fail, r.limit.fail, Agreement::fails);
  add("warn", r.beyond_warn, r.limit.warn, Agreement::warning);
}

void add_significance_checks(const Significance& s, std::vector<Check>& checks) {
  checks.push_back({fmt::format("pixels that stand out at k = {:g}", s.options.coverage_factor),
                    s.beyond > s.beyond_allowed ? Agreement::fails : Agreement::agrees,
                    static_cast<double>(s.beyond), static_cast<double>(s.beyond_allowed), "px",
                    fmt::format("{:.1f} expected by chance, of {}; chance of so many {:.2g}",
                                s.beyond_expected, s.pixels, s.beyond_p)});
  checks.push_back(
      {"farthest pixel", s.farthest > s.farthest_limit ? Agreement::warning : Agreement::agrees,
       s.farthest, s.farthest_limit, "sigma",
       fmt::format("{}; chance of one as far {:.2g}", place(s.farthest_at), s.farthest_p)});
  checks.push_back({"pixels without a score",
                    s.not_finite > 0 ? Agreement::fails : Agreement::agrees,
                    static_cast<double>(s.not_finite), 0.0, "px", ""});
}

/// The mean of each region in each band agrees up to |E_n| = 1; one of so many may be farther out
/// by chance, up to the family's own limit.
void add_region_check(const Comparison& c, std::vector<Check>& checks) {
  const RegionDifference* worst = nullptr;
  for (const RegionDifference& r : c.regions)
    if (std::isfinite(r.en) && (worst == nullptr || std::abs(r.en) > std::abs(worst->en)))
      worst = &r;
  if (worst == nullptr) return;
  const double level = normal_two_sided_tail(2.0);
  const double limit =
      normal_two_sided_quantile(sidak_level(level, c.regions.size())) / 2.0;  // U = 2 u
  const double en = std::abs(worst->en);
  checks.push_back({"largest |E_n| of a region",
                    en > limit ? Agreement::fails
                    : en > 1.0 ? Agreement::warning
                               : Agreement::agrees,
                    en, en > limit ? limit : 1.0, "1",
                    fmt::format("{}, {}; warns beyond 1, fails beyond {:.3g}, which {} means that "
                                "agree exceed as often as one exceeds 1",
                                worst->region, worst->channel, limit, c.regions.size())});
}

std::string share_text(double measured, double limit) {
  if (!(limit > 0.0)) return "none is allowed";
  const double share = measured / limit;
  if (share <= 1.0) return fmt::format("{:.3g} % of the limit {:.4g}", 100.0 * share, limit);
  return fmt::format("{:.3g} times the limit {:.4g}", share, limit);
}

std::string limit_sentence(const LimitResult& r) {
  if (!r.of_pixels) {
    const double limit = r.outcome == Agreement::fails ? r.limit.fail : r.limit.warn;
    return fmt::format("{}: {} is {}, {}",
                       r.outcome == Agreement::agrees ? "The images agree" : "The images differ",
                       quantity_text(r), with_unit(r.measured, r.unit),
                       share_text(r.measured, limit));
  }
  const std::string largest = fmt::format("the largest {} is {} at {}", quantity_text(r),
                                          with_unit(r.measured, r.unit), place(r.at));
  const bool fails = r.outcome == Agreement::fails;
  const double limit = fails ? r.limit.fail : r.limit.warn;
  const std::size_t beyond = fails ? r.beyond_fail : r.beyond_warn;
  if (r.outcome == Agreement::agrees && beyond == 0)
    return fmt::format("The images agree: {}, {}", largest,
                       limit > 0.0 ? share_text(r.measured, limit) : "and none is allowed");
  return fmt::format("{}{} of {} pixels differ by more than {} ({:.3g} % may); {}",
                     r.outcome == Agreement::agrees ? "The images agree: " : "", beyond, r.pixels,
                     with_unit(limit, r.unit), 100.0 * r.limit.allowed_fraction, largest);
}

std::string significance_sentence(const Significance& s) {
  if (s.pixels == 0) return "The images agree: no pixel differs, and none has an uncertainty";
  const double pixels = static_cast<double>(s.pixels);
  return fmt::format(
      "The images {} within k = {:g}: {:.3g} % of {} pixels stand out, {:.3g} % would by chance "
      "and "
      "{:.3g} % may; the farthest is {:.3g} sigma off at {} (limit {:.3g})",
      s.beyond > s.beyond_allowed ? "do not agree" : "agree", s.options.coverage_factor,
      100.0 * static_cast<double>(s.beyond) / pixels, s.pixels, 100.0 * s.beyond_expected / pixels,
      100.0 * static_cast<double>(s.beyond_allowed) / pixels, s.farthest, place(s.farthest_at),
      s.farthest_limit);
}

std::size_t not_finite_pixels(const Comparison& c) {
  std::size_t count = 0;
  const auto all = static_cast<std::size_t>(c.map.width) * static_cast<std::size_t>(c.map.height);
  for (std::size_t i = 0; i < all; ++i) {
    if (!c.map.counts(i)) continue;
    bool finite = true;
    for (const auto& channel : c.map.channels)
      finite =
          finite && std::isfinite(channel.difference[i]) && std::isfinite(channel.reference[i]);
    count += !finite;
  }
  return count;
}

}  // namespace

std::string place(const SamplePosition& at) {
  return fmt::format("pixel ({}, {}), {}", at.x_px, at.y_px, at.channel);
}

std::string with_unit(double value, const std::string& unit) {
  const std::string shown = unit_text(unit);
  return number_text(value, 4) + (shown.empty() ? "" : " " + shown);
}

std::vector<Check> comparison_checks(const Comparison& c) {
  std::vector<Check> checks;
  const std::size_t bad = not_finite_pixels(c);
  checks.push_back({"pixels not finite", bad > 0 ? Agreement::fails : Agreement::agrees,
                    static_cast<double>(bad), 0.0, "px", "NaN or Inf in either image"});
  for (const LimitResult& r : c.limits) add_limit_checks(r, checks);
  if (c.significance && c.significance_judges) add_significance_checks(*c.significance, checks);
  if (!c.regions.empty()) add_region_check(c, checks);
  return checks;
}

std::string comparison_sentence(const Comparison& c) {
  if (const std::size_t bad = not_finite_pixels(c); bad > 0)
    return fmt::format(
        "{} of {} pixels hold NaN or Inf, so nothing can be said for the test image.", bad,
        c.map.pixel_count());
  const Agreement outcome = worst_outcome(comparison_checks(c));
  if (c.significance && c.significance_judges && c.significance->outcome == outcome)
    return significance_sentence(*c.significance) + ".";
  for (const LimitResult& r : c.limits)
    if (r.outcome == outcome) return limit_sentence(r) + ".";
  for (const Check& check : comparison_checks(c))
    if (check.outcome == outcome && outcome != Agreement::agrees)
      return fmt::format("The images differ: {} is {:.4g}, {}: {}.", check.name, check.measured,
                         share_text(check.measured, check.limit), check.message);
  return c.significance ? significance_sentence(*c.significance) + "." : "Nothing was judged.";
}

}  // namespace truebox::app

// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <cmath>

#include "comparison.h"
#include "figures/text.h"

namespace truebox::app {
namespace {

constexpr std::size_t kMostRows = 400;  // of regions times bands; a page stays readable

Table channel_table(const Comparison& c) {
  const std::string& unit = c.map.unit;
  Table table{"Band by band",
              {{"Band"},
               {"Bias", unit},
               {"Mean absolute", unit},
               {"Root mean square", unit},
               {"Relative bias", "%", 3, true},
               {"Relative RMS", "%", 3, true},
               {"99th percentile", unit},
               {"Largest", unit},
               {"At"}},
              {}};
  if (c.map.has_uncertainty()) table.columns.push_back({"RMS z", "1", 3});
  for (std::size_t k = 0; k < c.map.channels.size(); ++k) {
    const DifferenceStatistics s = channel_statistics(c.map, k);
    table.rows.push_back({c.map.channels[k].name, s.bias, s.mean_absolute, s.rms,
                          100.0 * s.relative_bias, 100.0 * s.relative_rms, s.p99, s.max_absolute,
                          fmt::format("({}, {})", s.max_at.x_px, s.max_at.y_px)});
    if (c.map.has_uncertainty()) table.rows.back().push_back(s.rms_sigmas);
  }
  return table;
}

Table metric_table(const Comparison& c) {
  Table table{"What a viewer would see; 0 is no difference",
              {{"Metric"},
               {"Mean"},
               {"Median"},
               {"95th percentile"},
               {"99th percentile"},
               {"Largest"},
               {"At"},
               {"Unit"}},
              {}};
  for (const MetricMap& map : c.metrics) {
    const MetricSummary s = metric_summary(map, c.map.mask);
    table.rows.push_back({map.title, s.mean, s.p50, s.p95, s.p99, s.max,
                          fmt::format("({}, {})", s.max_at.x_px, s.max_at.y_px),
                          unit_text(map.unit)});
  }
  return table;
}

Table region_table(const Comparison& c) {
  const std::string& unit = c.map.unit;
  const bool all = c.regions.size() <= kMostRows;
  Table table{all ? "Surface by surface, band by band: means"
                  : "Surface by surface: the band with the largest relative difference",
              {{"Surface"},
               {"Band"},
               {"Pixels"},
               {"Test", unit},
               {"Reference", unit},
               {"Difference", unit},
               {"Relative", "%", 3, true},
               {"RMS", unit}},
              {}};
  const bool uncertain = c.map.has_uncertainty();
  if (uncertain) {
    table.columns.push_back({"E_n", "1", 2, true});
    table.columns.push_back({"chi^2 / pixel", "1", 3});
    table.columns.push_back({""});
  }
  const std::size_t bands = c.map.channels.size();
  for (std::size_t first = 0; first < c.regions.size(); first += bands) {
    std::size_t worst = first;
    for (std::size_t i = first; i < first + bands; ++i)
      if (std::abs(c.regions[i].relative) > std::abs(c.regions[worst].relative)) worst = i;
    for (std::size_t i = first; i < first + bands; ++i) {
      if (!all && i != worst) continue;
      const RegionDifference& r = c.regions[i];
      const auto n = static_cast<double>(r.pixels);
      const Cell difference = uncertain
                                  ? Cell(r.difference.value, r.difference.standard_uncertainty)
                                  : Cell(r.difference.value);
      table.rows.push_back({r.region, r.channel, std::to_string(r.pixels), r.test_mean,
                            r.reference_mean, difference, 100.0 * r.relative, r.rms});
      if (!uncertain) continue;
      table.rows.back().push_back(r.en);
      table.rows.back().push_back(r.chi_squared / n);
      table.rows.back().push_back(
          Cell(std::abs(r.en) <= 1.0 ? Agreement::agrees : Agreement::warning));
    }
  }
  return table;
}

Table significance_table(const Significance& s) {
  Table table{"Differences in units of their uncertainty, all pixels as one family",
              {{"Quantity"}, {"Seen"}, {"Expected if both agree"}, {"Chance of so much"}},
              {}};
  table.rows.push_back({"chi^2", s.chi_squared, s.degrees_of_freedom, s.chi_squared_p});
  table.rows.push_back({"mean z", s.mean_z, 0.0, ""});
  table.rows.push_back({"root mean square z", s.rms_z, 1.0, ""});
  table.rows.push_back({fmt::format("pixels that stand out at k = {:g}", s.options.coverage_factor),
                        static_cast<double>(s.beyond), s.beyond_expected, s.beyond_p});
  table.rows.push_back(
      {"largest |z| (expected: family-wise limit)", s.farthest, s.farthest_limit, s.farthest_p});
  return table;
}

Table histogram_table(const Significance& s) {
  Table table{"Samples by z, seen and expected of a normal distribution",
              {{"z from"}, {"to"}, {"Seen"}, {"Expected", "", 5}},
              {}};
  for (const ScoreBin& bin : s.histogram)
    table.rows.push_back({std::isinf(bin.from) ? Cell("less") : Cell(bin.from),
                          std::isinf(bin.to) ? Cell("more") : Cell(bin.to),
                          std::to_string(bin.seen), bin.expected});
  return table;
}

}  // namespace

Table statistics_table(const Comparison& c) {
  const DifferenceStatistics& s = c.statistics;
  const std::string unit = unit_text(c.map.unit);
  Table table{"Differences, test - reference, over all finite samples",
              {{"Statistic"}, {"Value"}, {"Unit"}},
              {}};
  const auto add = [&](const char* name, double value, const std::string& u) {
    table.rows.push_back({name, value, u});
  };
  add("samples", static_cast<double>(s.samples), "");
  add("not finite", static_cast<double>(s.not_finite), "");
  add("bias", s.bias, unit);
  add("mean absolute", s.mean_absolute, unit);
  add("root mean square", s.rms, unit);
  add("largest absolute", s.max_absolute, unit);
  add("median absolute", s.p50, unit);
  add("95th percentile", s.p95, unit);
  add("99th percentile", s.p99, unit);
  add("relative bias", 100.0 * s.relative_bias, "%");
  add("relative mean absolute", 100.0 * s.relative_mean_absolute, "%");
  add("relative root mean square", 100.0 * s.relative_rms, "%");
  add("relative MSE", s.relative_mse, "");
  add("SMAPE", 100.0 * s.smape, "%");
  add("PSNR", s.psnr_db, "dB");
  if (c.map.has_uncertainty()) add("root mean square z", s.rms_sigmas, "");
  return table;
}

std::vector<Table> comparison_tables(const Comparison& c) {
  std::vector<Table> tables = {statistics_table(c)};
  if (c.map.channels.size() > 1) tables.push_back(channel_table(c));
  if (!c.metrics.empty()) tables.push_back(metric_table(c));
  if (!c.regions.empty()) tables.push_back(region_table(c));
  if (c.significance) {
    tables.push_back(significance_table(*c.significance));
    tables.push_back(histogram_table(*c.significance));
  }
  return tables;
}

}  // namespace truebox::app

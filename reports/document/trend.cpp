// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "document/writers.h"
#include "figures/line_plot.h"

namespace truebox {
namespace {

constexpr std::size_t kMostEarlier = 50;
constexpr std::size_t kMostLines = 6;  // in the plot: the checks nearest to their limit

const Check* find(const std::vector<Check>& checks, const Check& like) {
  for (const Check& check : checks)
    if (check.name == like.name && check.unit == like.unit) return &check;
  return nullptr;
}

double share_of_limit(const Check& check, double measured) {
  return check.limit > 0.0 ? measured / check.limit : std::numeric_limits<double>::quiet_NaN();
}

Figure trend_figure(const std::vector<Check>& checks) {
  std::vector<const Check*> shown;
  for (const Check& check : checks)
    if (!check.earlier.empty() && std::isfinite(share_of_limit(check, check.measured)))
      shown.push_back(&check);
  std::stable_sort(shown.begin(), shown.end(), [](const Check* a, const Check* b) {
    return share_of_limit(*a, a->measured) > share_of_limit(*b, b->measured);
  });
  if (shown.size() > kMostLines) shown.resize(kMostLines);
  LinePlot plot{"Measured over limit, run by run",
                {"runs before this one", ""},
                {"measured / limit", ""},
                {}};
  for (const Check* check : shown) {
    PlotSeries series{check->name, {}, {}};
    const auto n = static_cast<double>(check->earlier.size());
    for (std::size_t i = 0; i < check->earlier.size(); ++i) {
      series.x.push_back(static_cast<double>(i) - n);
      series.y.push_back(share_of_limit(*check, check->earlier[i]));
    }
    series.x.push_back(0.0);
    series.y.push_back(share_of_limit(*check, check->measured));
    series.markers = true;
    plot.series.push_back(std::move(series));
  }
  if (plot.series.empty()) return {};
  return {"Trend", to_svg(plot), "0 is this run; above 1 a limit is exceeded."};
}

}  // namespace

void add_trend(Report& report, const Report& baseline) {
  Table table{"Against the earlier run",
              {{"Check"},
               {"Then"},
               {"Now"},
               {"Change"},
               {"Limit"},
               {"Unit"},
               {"Outcome then"},
               {"Outcome now"}},
              {}};
  std::string came, went;
  for (Check& check : report.checks) {
    const Check* before = find(baseline.checks, check);
    if (before == nullptr) {
      came += (came.empty() ? "" : ", ") + check.name;
      continue;
    }
    check.earlier = before->earlier;
    check.earlier.push_back(before->measured);
    if (check.earlier.size() > kMostEarlier)
      check.earlier.erase(check.earlier.begin(), check.earlier.end() - kMostEarlier);
    table.rows.push_back({check.name, before->measured, check.measured,
                          check.measured - before->measured, check.limit, check.unit,
                          Cell(before->outcome), Cell(check.outcome)});
  }
  for (const Check& check : baseline.checks)
    if (find(report.checks, check) == nullptr) went += (went.empty() ? "" : ", ") + check.name;
  Section section{"Since the baseline", {}};
  section.blocks.push_back(
      Paragraph{fmt::format("The earlier run, {}, came to: {}. {}", baseline.title,
                            to_text(baseline.verdict.outcome), baseline.verdict.sentence)});
  if (!table.rows.empty()) section.blocks.push_back(table);
  if (Figure figure = trend_figure(report.checks); !figure.svg.empty())
    section.blocks.push_back(std::move(figure));
  if (!came.empty()) section.blocks.push_back(Paragraph{"Not in the earlier run: " + came + "."});
  if (!went.empty()) section.blocks.push_back(Paragraph{"Only in the earlier run: " + went + "."});
  report.sections.push_back(std::move(section));
}

}  // namespace truebox

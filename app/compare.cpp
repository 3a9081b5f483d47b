// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <filesystem>
#include <memory>

#include "commands.h"
#include "comparison.h"
#include "document/writers.h"
#include "figures/text.h"
#include "image/image_file.h"
#include "text_file.h"

namespace truebox::app {
namespace {

struct CompareArguments {
  ComparisonArguments comparison;
  std::string directory, json, junit, markdown, badge, metrics, baseline;
  bool annotations = false;
};

void print_summary(const Comparison& c, const Verdict& verdict) {
  for (const auto& row : statistics_table(c).rows)
    fmt::print("{:<26}{:>14} {}\n", row[0].text, number_text(*row[1].number, 5), row[2].text);
  for (const MetricMap& map : c.metrics) {
    const MetricSummary s = metric_summary(map, c.map.mask);
    fmt::print("{:<26}{:>14} {}\n", "mean " + map.title, number_text(s.mean, 5),
               unit_text(map.unit));
  }
  fmt::print("{:<26}{}\n\n{}: {}\n", "largest at", place(c.statistics.max_at),
             to_text(verdict.outcome), verdict.sentence);
}

int run_compare(const CompareArguments& a) {
  const Comparison c = compare(a.comparison);
  Report report = comparison_report(a.comparison, c);
  if (!a.baseline.empty()) add_trend(report, from_json(read_text(a.baseline), a.baseline));
  print_summary(c, report.verdict);
  if (!a.directory.empty()) {
    write_report(a.directory, report);
    write_exr(std::filesystem::path(a.directory) / "difference.exr", to_image(c.map));
    fmt::print("{}\n", (std::filesystem::path(a.directory) / "report.html").string());
  }
  if (!a.json.empty()) write_file_atomically(a.json, to_json(report));
  if (!a.junit.empty()) write_file_atomically(a.junit, to_junit(report));
  if (!a.markdown.empty()) write_file_atomically(a.markdown, to_markdown(report));
  if (!a.badge.empty()) write_file_atomically(a.badge, to_badge(report));
  if (!a.metrics.empty()) write_file_atomically(a.metrics, to_openmetrics(report));
  if (a.annotations) fmt::print("{}", to_annotations(report));
  return exit_code(report.verdict.outcome);
}

}  // namespace

void add_compare_command(CLI::App& program, Action& chosen) {
  auto a = std::make_shared<CompareArguments>();
  CLI::App* command = program.add_subcommand(
      "compare",
      "Compares two images (EXR, PNG, TIFF; spectral or RGB) and says whether they agree");
  add_comparison_options(*command, a->comparison);
  const char* group = "Results";
  const auto file = [&](const char* name, std::string& path, const char* text) {
    command->add_option(name, path, text)->group(group);
  };
  file("-o,--output", a->directory, "folder for the report and difference.exr");
  file("--json", a->json, "file for the full report as JSON");
  file("--junit", a->junit, "file for the checks as JUnit XML");
  file("--markdown", a->markdown, "file for a summary in Markdown");
  file("--badge", a->badge, "file for a badge (shields.io endpoint)");
  file("--metrics", a->metrics, "file for the checks as OpenMetrics");
  file("--baseline", a->baseline, "report.json of an earlier run, to show the trend");
  command->add_flag("--annotations", a->annotations, "print what GitHub shows beside a change")
      ->group(group);
  command->footer(
      "Exit code: 0 agrees, 1 warning, 2 fails, 3 sizes or bands differ, 4 unreadable.\n"
      "Example:\n  truebox compare render.exr photo.exr --relative --warn 0.02 --fail 0.05 -o out\n"
      "  truebox compare noisy.exr box.exr --uncertainty noisy_stderr.exr --statistical -o out");
  command->callback([=, &chosen] {
    check_comparison(a->comparison);
    chosen = [a] { return run_compare(*a); };
  });
}

}  // namespace truebox::app

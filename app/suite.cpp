// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>

#include "commands.h"
#include "document/suite_index.h"
#include "document/writers.h"
#include "image/image_file.h"
#include "prediction_options.h"
#include "radiometry/input_error.h"
#include "suite_file.h"
#include "text_file.h"

namespace truebox::app {
namespace {

namespace fs = std::filesystem;

struct SuiteArguments {
  std::string file, directory = "out/suite", baseline;
  std::size_t threads = 0;
  bool annotations = false, quiet = false;
};

/// What one comparison of a suite left behind.
struct Result {
  SuiteEntry entry;
  int code = kCannotWrite;
  std::size_t findings = 0;  ///< checks that do not agree
};

void compare_into(const SuiteComparison& comparison, const SuiteArguments& a, Result& result) {
  const Comparison c = compare(comparison.arguments);
  Report report = comparison_report(comparison.arguments, c, &result.entry.thumbnails);
  if (!a.baseline.empty()) {
    const std::string earlier = (fs::path(a.baseline) / comparison.name / "report.json").string();
    if (fs::exists(earlier)) add_trend(report, from_json(read_text(earlier), earlier));
  }
  const fs::path folder = fs::path(a.directory) / comparison.name;
  write_report(folder, report);
  write_exr(folder / "difference.exr", to_image(c.map));
  result.entry.page = comparison.name + "/report.html";
  result.entry.outcome = report.verdict.outcome;
  result.entry.sentence = report.verdict.sentence;
  for (const Check& check : report.checks) {
    result.findings += check.outcome != Agreement::agrees;
    if (check.limit > 0.0)
      result.entry.nearness = std::max(result.entry.nearness, check.measured / check.limit);
  }
  result.code = exit_code(report.verdict.outcome);
}

/// One that cannot be compared says why and leaves the others alone.
Result run_one(const SuiteComparison& comparison, const SuiteArguments& a) {
  Result result;
  result.entry.name = comparison.name;
  result.entry.tags = comparison.tags;
  const auto stopped = [&](int code, const std::exception& error) {
    result.code = code;
    result.entry.outcome = Agreement::not_run;
    result.entry.sentence = error.what();
    result.findings = 1;
  };
  try {
    compare_into(comparison, a, result);
  } catch (const InputError& error) {
    stopped(kUnreadable, error);
  } catch (const MismatchError& error) {
    stopped(kMismatch, error);
  } catch (const std::exception& error) {
    stopped(kCannotWrite, error);
  }
  return result;
}

Report suite_report(const Suite& suite, const std::vector<Result>& results,
                    const std::string& file) {
  Report report;
  report.title = suite.title;
  report.subtitle = fmt::format("{} comparisons", results.size());
  Table table{"Every comparison", {{"Comparison"}, {"Outcome"}, {"Verdict"}}, {}};
  std::size_t agreeing = 0;
  const Result* worst = nullptr;
  for (const Result& r : results) {
    report.checks.push_back({r.entry.name, r.entry.outcome, static_cast<double>(r.findings), 0.0,
                             "checks", r.entry.sentence});
    table.rows.push_back({r.entry.name, Cell(r.entry.outcome), r.entry.sentence});
    agreeing += r.entry.outcome == Agreement::agrees;
    if (worst == nullptr || r.entry.outcome > worst->entry.outcome ||
        (r.entry.outcome == worst->entry.outcome && r.entry.nearness > worst->entry.nearness))
      worst = &r;
  }
  report.verdict.outcome = worst_outcome(report.checks);
  const auto count = [&](Agreement outcome) {
    return std::count_if(results.begin(), results.end(),
                         [&](const Result& r) { return r.entry.outcome == outcome; });
  };
  report.verdict.sentence = fmt::format(
      "{} of {} comparisons agree, {} warn, {} fail, {} could not be run; {} is {}: {}", agreeing,
      results.size(), count(Agreement::warning), count(Agreement::fails), count(Agreement::not_run),
      report.verdict.outcome == Agreement::agrees ? "nearest to its limit" : "worst",
      worst->entry.name, worst->entry.sentence);
  report.sections = {{"Comparisons", {std::move(table)}}};
  report.provenance = {{"Suite", file}};
  return report;
}

int run_suite(const SuiteArguments& a) {
  const Suite suite = read_suite(a.file);
  std::optional<tbb::global_control> limit;
  if (a.threads > 0) limit.emplace(tbb::global_control::max_allowed_parallelism, a.threads);
  std::vector<Result> results(suite.comparisons.size());
  const Progress progress = terminal_progress(a.quiet);
  std::mutex told;
  std::size_t done = 0;
  tbb::parallel_for(std::size_t{0}, results.size(), [&](std::size_t i) {
    results[i] = run_one(suite.comparisons[i], a);
    const std::lock_guard lock(told);
    ++done;
    if (progress)
      progress("comparing", static_cast<double>(done) / static_cast<double>(results.size()));
  });
  if (progress) progress("", 1.0);

  const Report report = suite_report(suite, results, a.file);
  std::vector<SuiteEntry> entries;
  int code = kAgrees;
  for (const Result& r : results) {
    entries.push_back(r.entry);
    code = std::max(code, r.code);
    fmt::print("{:<10}{}: {}\n", to_text(r.entry.outcome), r.entry.name, r.entry.sentence);
  }
  write_report(a.directory, report);
  const fs::path index = fs::path(a.directory) / "index.html";
  write_file_atomically(index, to_suite_html(suite.title, report.verdict, entries));
  fmt::print("\n{}: {}\n{}\n", to_text(report.verdict.outcome), report.verdict.sentence,
             index.string());
  if (a.annotations) fmt::print("{}", to_annotations(report));
  return code;
}

}  // namespace

void add_suite_command(CLI::App& program, Action& chosen) {
  auto a = std::make_shared<SuiteArguments>();
  CLI::App* command = program.add_subcommand(
      "suite", "Runs many comparisons in parallel, with one page over all of them");
  command->add_option("SUITE", a->file, "suite file (TOML)")->required();
  command->add_option("-o,--output", a->directory, "folder for index.html and the reports")
      ->capture_default_str();
  command->add_option("--baseline", a->baseline, "output folder of an earlier run, for the trend");
  command->add_option("--threads", a->threads, "0: all")->capture_default_str();
  command->add_flag("--annotations", a->annotations, "print what GitHub shows beside a change");
  command->add_flag("--quiet", a->quiet, "no progress");
  command->footer(
      "A comparison that cannot be run does not stop the others. Exit code: the worst of all.\n"
      "A suite file:\n  [defaults]\n  relative = true\n  warn = 0.02\n  fail = 0.05\n"
      "  [[compare]]\n  name = \"box\"\n  tags = [\"indirect\"]\n  test = \"box.exr\"\n"
      "  reference = \"reference.exr\"\nExample:\n  truebox suite renders.toml -o out/suite");
  command->callback([a, &chosen] { chosen = [a] { return run_suite(*a); }; });
}

}  // namespace truebox::app

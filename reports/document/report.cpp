// SPDX-License-Identifier: BSD-3-Clause
#include "document/report.h"

#include <utility>

#include "document/writers.h"
#include "image/image_file.h"

namespace truebox {

Agreement worst_outcome(const std::vector<Check>& checks) {
  if (checks.empty()) return Agreement::not_run;
  Agreement worst = Agreement::agrees;
  for (const auto& check : checks) worst = worse(worst, check.outcome);
  return worst;
}

int exit_code(Agreement outcome) {
  if (outcome == Agreement::agrees) return 0;
  return outcome == Agreement::warning ? 1 : 2;
}

void write_report(const std::filesystem::path& directory, const Report& report) {
  const std::pair<const char*, std::string> files[] = {
      {"report.html", to_html(report)},
      {"report.json", to_json(report)},
      {"junit.xml", to_junit(report, {(directory / "report.html").generic_string()})},
      {"summary.md", to_markdown(report)},
      {"badge.json", to_badge(report)},
      {"metrics.txt", to_openmetrics(report)}};
  // A disk that fills half way must not leave a new page beside old numbers: all are written
  // before any takes its name.
  const auto unnamed = [&](const char* name) { return directory / (std::string(name) + ".new"); };
  try {
    for (const auto& [name, text] : files) write_file_atomically(unnamed(name), text);
  } catch (...) {
    std::error_code ignored;
    for (const auto& file : files) std::filesystem::remove(unnamed(file.first), ignored);
    throw;
  }
  for (const auto& file : files)
    std::filesystem::rename(unnamed(file.first), directory / file.first);
}

}  // namespace truebox

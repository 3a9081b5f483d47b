// SPDX-License-Identifier: BSD-3-Clause
#include "document/report.h"

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
  write_file_atomically(directory / "report.html", to_html(report));
  write_file_atomically(directory / "report.json", to_json(report));
  write_file_atomically(directory / "junit.xml",
                        to_junit(report, {(directory / "report.html").generic_string()}));
  write_file_atomically(directory / "summary.md", to_markdown(report));
  write_file_atomically(directory / "badge.json", to_badge(report));
  write_file_atomically(directory / "metrics.txt", to_openmetrics(report));
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "document/writers.h"
#include "figures/text.h"

namespace truebox {
namespace {

/// GitHub's own escapes for the data and, `property`, for the properties of a command.
std::string workflow_text(const std::string& text, bool property) {
  std::string result;
  for (char c : valid_text(text)) {
    if (c == '%')
      result += "%25";
    else if (c == '\r' || c == '\n')
      result += c == '\r' ? "%0D" : "%0A";
    else if (property && (c == ':' || c == ','))
      result += c == ':' ? "%3A" : "%2C";
    else
      result += c;
  }
  return result;
}

std::string annotation(const char* kind, const std::string& title, const std::string& message) {
  return fmt::format("::{} title={}::{}\n", kind, workflow_text(title, true),
                     workflow_text(message, false));
}

std::string unit_suffix(const std::string& unit) {
  return unit.empty() || unit == "1" ? "" : " " + unit;
}

/// OpenMetrics escapes in label values.
std::string label_value(const std::string& text) {
  std::string result;
  for (char c : valid_text(text)) {
    if (c == '\\' || c == '"') result += '\\';
    if (c == '\n')
      result += "\\n";
    else
      result += c;
  }
  return result;
}

std::string metric_number(double value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0.0 ? "+Inf" : "-Inf";
  return fmt::format("{}", value);
}

}  // namespace

std::string to_annotations(const Report& report) {
  constexpr int kMost = 10;  // GitHub keeps ten of a kind a step
  std::string text;
  int errors = 0, warnings = 0;
  for (const Check& check : report.checks) {
    if (check.outcome == Agreement::agrees) continue;
    const bool warns = check.outcome == Agreement::warning;
    if ((warns ? warnings : errors)++ >= kMost) continue;
    text += annotation(warns ? "warning" : "error", report.title + ": " + check.name,
                       fmt::format("measured {:.6g}{}, limit {:.6g}. {}", check.measured,
                                   unit_suffix(check.unit), check.limit, check.message));
  }
  return text + annotation("notice", report.title,
                           to_text(report.verdict.outcome) + ": " + report.verdict.sentence);
}

std::string to_badge(const Report& report) {
  const Agreement outcome = report.verdict.outcome;
  const char* colour = outcome == Agreement::agrees    ? "brightgreen"
                       : outcome == Agreement::warning ? "yellow"
                                                       : "red";
  const nlohmann::ordered_json badge = {{"schemaVersion", 1},
                                        {"label", "truebox"},
                                        {"message", to_text(outcome)},
                                        {"color", colour},
                                        {"isError", outcome > Agreement::warning}};
  return badge.dump(1) + "\n";
}

std::string to_openmetrics(const Report& report) {
  const auto family = [&](const char* name, const char* help, auto value_of) {
    std::string text = fmt::format("# TYPE {0} gauge\n# HELP {0} {1}\n", name, help);
    std::vector<std::string> seen;  // a label set may stand once
    for (const Check& check : report.checks) {
      const std::string labels =
          fmt::format("{{report=\"{}\",check=\"{}\",unit=\"{}\"}}", label_value(report.title),
                      label_value(check.name), label_value(check.unit));
      if (std::find(seen.begin(), seen.end(), labels) != seen.end()) continue;
      seen.push_back(labels);
      text += fmt::format("{}{} {}\n", name, labels, metric_number(value_of(check)));
    }
    return text;
  };
  return family("truebox_check_measured", "What a check measured, in its unit.",
                [](const Check& c) { return c.measured; }) +
         family("truebox_check_limit", "What it may be at most.",
                [](const Check& c) { return c.limit; }) +
         family("truebox_check_outcome", "0 agrees, 1 warning, 2 fails or not run.",
                [](const Check& c) { return static_cast<double>(exit_code(c.outcome)); }) +
         fmt::format(
             "# TYPE truebox_verdict gauge\n"
             "# HELP truebox_verdict 0 agrees, 1 warning, 2 fails or not run.\n"
             "truebox_verdict{{report=\"{}\"}} {}\n# EOF\n",
             label_value(report.title), exit_code(report.verdict.outcome));
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>

#include "document/writers.h"
#include "figures/text.h"

namespace truebox {
namespace {

bool is_failure(const Check& check) { return check.outcome > Agreement::warning; }

std::string plain_number(double value) { return fmt::format("{:.6g}", value); }

std::string with_unit(double value, const std::string& unit) {
  return plain_number(value) + (unit.empty() || unit == "1" ? "" : " " + unit);
}

std::string property(const std::string& name, const std::string& value) {
  return fmt::format("        <property name=\"{}\" value=\"{}\"/>\n", xml_escape(name),
                     xml_escape(value));
}

/// The form in which GitLab and the Jenkins attachments plug-in look for a file.
std::string attachment_lines(const std::vector<std::string>& attachments) {
  std::string lines;
  for (const std::string& path : attachments) lines += "\n[[ATTACHMENT|" + path + "]]";
  return lines;
}

std::string test_case(const std::string& suite, const Check& check,
                      const std::vector<std::string>& attachments) {
  const std::string summary = fmt::format("{}: measured {}, limit {}. {}", to_text(check.outcome),
                                          with_unit(check.measured, check.unit),
                                          with_unit(check.limit, check.unit), check.message);
  std::string xml = fmt::format("    <testcase classname=\"{}\" name=\"{}\" time=\"0\">\n", suite,
                                xml_escape(check.name));
  xml += "      <properties>\n" + property("measured", plain_number(check.measured)) +
         property("limit", plain_number(check.limit)) + property("unit", check.unit) +
         property("outcome", to_text(check.outcome)) + "      </properties>\n";
  if (is_failure(check))
    xml += fmt::format("      <failure message=\"{0}\" type=\"limit\">{0}</failure>\n",
                       xml_escape(summary));
  const std::string files = is_failure(check) ? attachment_lines(attachments) : "";
  xml += fmt::format("      <system-out>{}</system-out>\n    </testcase>\n",
                     xml_escape(summary + files));
  return xml;
}

/// One line without characters that Markdown or HTML would take as mark-up.
std::string markdown_text(const std::string& text) {
  std::string result;
  for (char c : valid_text(text)) {
    if (c == '\n' || c == '\t') c = ' ';
    if (c == '<' || c == '>' || c == '&') {
      result += c == '<' ? "&lt;" : c == '>' ? "&gt;" : "&amp;";
      continue;
    }
    if (std::string_view("\\`*_[]|#~@!").find(c) != std::string_view::npos) result += '\\';
    result += c;
  }
  return result;
}

const char* icon(Agreement outcome) {
  switch (outcome) {
    case Agreement::agrees: return "✅ agrees";
    case Agreement::warning: return "⚠️ warning";
    case Agreement::fails: return "❌ fails";
    case Agreement::not_run: break;
  }
  return "❌ not run";
}

}  // namespace

std::string to_junit(const Report& report, const std::vector<std::string>& attachments) {
  const std::string suite = xml_escape(report.title);
  const auto failures = std::count_if(report.checks.begin(), report.checks.end(), is_failure);
  const std::string counts =
      fmt::format("name=\"{}\" tests=\"{}\" failures=\"{}\" errors=\"0\" skipped=\"0\" time=\"0\"",
                  suite, report.checks.size(), failures);
  std::string xml = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites " + counts +
                    ">\n  <testsuite " + counts + ">\n    <properties>\n";
  xml += property("verdict", to_text(report.verdict.outcome)) +
         property("sentence", report.verdict.sentence);
  for (const auto& n : report.key_numbers) xml += property(n.label, with_unit(n.value, n.unit));
  for (const auto& s : report.provenance) xml += property(s.name, s.value);
  xml += "    </properties>\n";
  for (const auto& check : report.checks) xml += test_case(suite, check, attachments);
  return xml + "  </testsuite>\n</testsuites>\n";
}

std::string to_markdown(const Report& report) {
  constexpr std::size_t kRoom = 900'000;  // bytes; GitHub drops a summary of over 1 MiB
  std::string md =
      fmt::format("## {}\n\n**{}**: {}\n", markdown_text(report.title),
                  icon(report.verdict.outcome), markdown_text(report.verdict.sentence));
  if (!report.subtitle.empty()) md += "\n" + markdown_text(report.subtitle) + "\n";
  if (!report.key_numbers.empty()) md += "\n";
  for (const auto& n : report.key_numbers)
    md += fmt::format("- {}: {}{}{}\n", markdown_text(n.label), number_text(n.value, n.digits),
                      n.unit.empty() || n.unit == "1" ? "" : " " + markdown_text(unit_text(n.unit)),
                      n.note.empty() ? "" : " (" + markdown_text(n.note) + ")");
  if (report.checks.empty()) return md;
  std::vector<const Check*> sorted;
  for (const auto& check : report.checks) sorted.push_back(&check);
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Check* a, const Check* b) { return a->outcome > b->outcome; });
  md += "\n| outcome | check | measured | limit | unit |\n|---|---|---:|---:|---|\n";
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    const Check& c = *sorted[i];
    const std::string row = fmt::format("| {} | {} | {} | {} | {} |\n", icon(c.outcome),
                                        markdown_text(c.name), plain_number(c.measured),
                                        plain_number(c.limit), markdown_text(unit_text(c.unit)));
    if (md.size() + row.size() > kRoom)
      return md + fmt::format("\n{} more checks are in report.html.\n", sorted.size() - i);
    md += row;
  }
  return md;
}

}  // namespace truebox

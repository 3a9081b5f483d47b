// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "document/report.h"

namespace truebox {

/// One HTML file that needs no network and no JavaScript: pictures and styles are inside.
/// Throws std::invalid_argument if a figure is no plain drawing (script, link, event handler) or a
/// table row has other than its columns' number of cells.
std::string to_html(const Report& report);

/// Everything in the report, numbers to their last bit, pictures as base64. Not finite numbers are
/// the strings "nan", "inf", "-inf". Text that is no UTF-8 is replaced as in the HTML.
std::string to_json(const Report& report);

/// The report again: to_html(from_json(to_json(r))) == to_html(r). `file` is for messages.
/// Throws InputError on anything malformed, unknown versions and unsafe figures included.
Report from_json(const std::string& text, const std::string& file);

/// JUnit XML with one test case a check: fails and not run are failures, a warning passes with a
/// note. Numbers have a fixed form, since CI servers compare them as text. Verdict and sources are
/// properties of the suite; each failure names the attachments (paths as the server should see
/// them), in the form that GitLab and Jenkins look for.
std::string to_junit(const Report& report, const std::vector<std::string>& attachments = {});

/// Verdict, key numbers and checks as Markdown, the worst first, below the 1 MiB at which GitHub
/// drops a step summary.
std::string to_markdown(const Report& report);

/// Lines that GitHub shows beside a change: an error for each check that fails, a warning for each
/// that warns, at most ten of each (more are dropped there), and the verdict as a notice.
std::string to_annotations(const Report& report);

/// The JSON of a badge (shields.io, "endpoint"): label, outcome and colour.
std::string to_badge(const Report& report);

/// OpenMetrics 1.0 text: for each check measured, limit and outcome; units stay labels.
std::string to_openmetrics(const Report& report);

/// Holds a report against an earlier one: every check that both have, by name and unit, gets the
/// earlier numbers (at most 50), and a section shows then, now and the trend. Checks that came or
/// went are named.
void add_trend(Report& report, const Report& baseline);

/// Writes report.html, report.json, junit.xml, summary.md, badge.json and metrics.txt
/// (OpenMetrics), all of them complete or none. The failures in junit.xml name the page.
void write_report(const std::filesystem::path& directory, const Report& report);

}  // namespace truebox

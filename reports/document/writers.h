// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

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
/// note. Numbers have a fixed form, since CI servers compare them as text.
std::string to_junit(const Report& report);

/// Verdict, key numbers and checks as Markdown, the worst first, below the 1 MiB at which GitHub
/// drops a step summary.
std::string to_markdown(const Report& report);

/// Writes report.html, report.json, junit.xml and summary.md, each complete or not at all.
void write_report(const std::filesystem::path& directory, const Report& report);

}  // namespace truebox

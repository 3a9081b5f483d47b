// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "document/report.h"

namespace truebox {

/// One comparison of many, as a card on the index page.
struct SuiteEntry {
  std::string name;
  Agreement outcome = Agreement::not_run;
  std::string sentence;           ///< its verdict, or why there is none
  std::string page;               ///< relative address of its report; empty if there is none
  std::vector<std::string> tags;  ///< to filter by
  std::vector<Panel> thumbnails;  ///< small pictures, with what they show
  double nearness = 0.0;          ///< largest measured / limit of its checks; the order of the page
};

/// One HTML page over many reports, without network, readable without JavaScript: all entries, the
/// worst first. With JavaScript: filters by outcome, tag and name.
std::string to_suite_html(const std::string& title, const Verdict& verdict,
                          const std::vector<SuiteEntry>& entries);

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "comparison.h"

namespace truebox::app {

/// One `[[compare]]` of a suite file.
struct SuiteComparison {
  std::string name;  ///< also the name of its folder: letters, digits, '.', '_', '-'
  std::vector<std::string> tags;
  ComparisonArguments arguments;  ///< paths as the suite file sees them, made absolute or relative
                                  ///< to the working folder
};

struct Suite {
  std::string title;
  std::vector<SuiteComparison> comparisons;
};

/// Reads a suite: `title`, a table `[defaults]`, and `[[compare]]` with `name`, `tags` and the
/// options of `truebox compare` by their names ("reference-stderr" or "reference_stderr"); paths
/// are relative to the file. An entry's value goes before that of the defaults. Throws InputError
/// with the line: unknown keys, values that the option refuses, equal names.
Suite read_suite(const std::string& path);

}  // namespace truebox::app

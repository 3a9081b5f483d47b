// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "document/report.h"

namespace truebox::app {

/// What one subject brings to a report: its checks, sections and sources, and its half of the
/// verdict's sentence.
struct ReportPart {
  std::vector<Check> checks;
  std::vector<Section> sections;
  std::vector<Setting> provenance;
  std::string sentence;
};

}  // namespace truebox::app

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "document/report.h"
#include "prediction_options.h"
#include "verification/accuracy_check.h"

namespace truebox::app {

/// Stands for every group that needs no prediction of the Cornell Box.
inline constexpr const char* kClosedForms = "closed forms";

/// Every group of checks, the one named, or kClosedForms.
std::vector<AccuracyCheck> run_validation(const std::filesystem::path& reference_dir,
                                          const std::string& only, std::size_t elements,
                                          const Progress& progress);

/// The same as checks of a report.
std::vector<Check> report_checks(const std::vector<AccuracyCheck>& checks);

}  // namespace truebox::app

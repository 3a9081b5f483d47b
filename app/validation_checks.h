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

/// The group that compares whole pictures; it takes longest and runs only when named.
inline constexpr const char* kRender = "render";

/// Every group of checks but kRender, the one named, or kClosedForms. `p_values`, if not null, gets
/// the maps of kRender.
std::vector<AccuracyCheck> run_validation(const std::filesystem::path& reference_dir,
                                          const std::string& only, std::size_t elements,
                                          const Progress& progress, Image* p_values = nullptr);

/// The same as checks of a report.
std::vector<Check> report_checks(const std::vector<AccuracyCheck>& checks);

}  // namespace truebox::app

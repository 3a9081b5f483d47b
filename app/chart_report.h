// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <vector>

#include "document/report.h"
#include "fit/chart_measurement.h"
#include "scene/requirements.h"

namespace truebox::app {

/// What a report says of a chart measurement: checks, sections (pictures, fitted against certified
/// values, spectra, colour differences) and the sources behind it.
struct ChartReport {
  std::vector<Check> checks;
  std::vector<Section> sections;
  std::vector<Setting> provenance;
  std::string sentence;  ///< for the verdict
};

/// `plan` is what the chart, as a scene, requires; `colour_dir` holds the CIE tables.
ChartReport chart_report(const ChartMeasurement& measurement, const Requirements& plan,
                         const std::filesystem::path& colour_dir);

}  // namespace truebox::app

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <vector>

#include "fit/chart_measurement.h"
#include "report_part.h"
#include "scene/requirements.h"

namespace truebox::app {

/// A chart measurement: pictures, fitted against certified values, spectra, colour differences.
/// `plan` is what the chart, as a scene, requires; `colour_dir` holds the CIE tables.
ReportPart chart_report(const ChartMeasurement& measurement, const Requirements& plan,
                        const std::filesystem::path& colour_dir);

}  // namespace truebox::app

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <vector>

#include "prediction_options.h"
#include "report_part.h"
#include "sensor/render.h"
#include "verification/accuracy_check.h"
#include "verification/render_agreement.h"

namespace truebox::app {

/// The predicted Cornell Box and the program's certified checks: pictures, bound, z scores, digits.
/// `image` is the prediction through the camera of the independent render in `reference_dir`.
ReportPart box_report(const Predicted& predicted, const RenderedImage& image,
                      const std::vector<AccuracyCheck>& accuracy,
                      const std::filesystem::path& reference_dir);

}  // namespace truebox::app

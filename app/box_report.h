// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <vector>

#include "document/report.h"
#include "prediction_options.h"
#include "sensor/render.h"
#include "verification/accuracy_check.h"
#include "verification/render_agreement.h"

namespace truebox::app {

/// What a report says of the predicted Cornell Box and of the program's certified checks.
struct BoxReport {
  std::vector<Check> checks;
  std::vector<Section> sections;
  std::vector<Setting> provenance;
  std::string sentence;  ///< for the verdict
};

/// `image` is the prediction through the camera of the independent render in `reference_dir`.
BoxReport box_report(const Predicted& predicted, const RenderedImage& image,
                     const std::vector<AccuracyCheck>& accuracy,
                     const std::filesystem::path& reference_dir);

}  // namespace truebox::app

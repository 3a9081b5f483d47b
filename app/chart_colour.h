// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <vector>

#include "colour/colour_pipeline.h"
#include "document/report.h"
#include "fit/chart_measurement.h"
#include "radiometry/observer.h"

namespace truebox::app {

/// Colours of a chart measured in a few bands, under D65 for the CIE 1931 observer: each band
/// stands for the wavelengths nearest to it, a perfect white has Y = 1.
class ChartColour {
 public:
  ChartColour(const ChartMeasurement& measurement, const std::filesystem::path& colour_dir);

  /// Photograph and prediction in colour at one exposure, and their signed difference at 550 nm.
  PictureRow pictures(const ColourPipeline& pipeline) const;

  /// CIEDE2000 between the fitted and the certified bands of each held-out patch.
  Table table() const;

 private:
  Tristimulus colour_of(const std::vector<double>& reflectance) const;
  Image composite(std::vector<float> ChartPlanes::*plane) const;
  ImageSet numbers_behind(double exposure) const;

  const ChartMeasurement& measurement_;
  std::vector<Tristimulus> weights_;  // one a band
};

}  // namespace truebox::app

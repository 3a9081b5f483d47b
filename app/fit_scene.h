// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "document/report.h"
#include "fit/scene_measurement_fit.h"
#include "fit/scene_select.h"

namespace truebox::app {

struct FitSceneArguments {
  std::string measurement;
  std::string output;     ///< JSON, or empty
  std::string directory;  ///< of report and residual maps, or empty
  bool select = false;
};

/// `truebox fit` of a measurement that names a scene and photographs; returns the exit code.
int fit_scene_measurement(const FitSceneArguments& arguments);

/// What a fit of a scene found, for every writer.
struct SceneFitRun {
  SceneMeasurement measurement;
  SceneFit fit;
  std::vector<FittedReading> held_out;
  std::vector<ModelCandidate> candidates;  ///< empty unless asked for
};

/// Share of readings within 2 u of what the fit predicts.
double share_within(const std::vector<FittedReading>& readings);
double rms_relative(const std::vector<FittedReading>& readings);

/// How the readings of one surface, all planes together, fit.
struct SurfaceResidual {
  std::string surface;
  std::size_t readings = 0;
  double mean_percent = 0.0;  ///< mean reading over mean of the model, less 100 %
  double chi2 = 0.0;          ///< a reading
  double farthest = 0.0;      ///< largest |z|
};
std::vector<SurfaceResidual> surface_residuals(const SceneFitRun& run);

nlohmann::json scene_fit_json(const SceneFitRun& run);
Report scene_fit_report(const SceneFitRun& run);
/// residuals.exr: for each plane reading, prediction, their difference and z, painted on the pixels
/// of each block (NaN elsewhere); residuals_<n>.png: z of each plane.
void write_residual_maps(const SceneFitRun& run, const std::filesystem::path& directory);
Image residual_map(const SceneFitRun& run);

}  // namespace truebox::app

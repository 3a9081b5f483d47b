// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "fit/scene_shape.h"
#include "image/image.h"
#include "readings/scene_measurement.h"

namespace truebox {

/// What became of the pixels of a plane.
struct PlaneCounts {
  std::string name;
  std::size_t pixels = 0;  ///< of the photograph
  std::size_t used = 0, held_out = 0, masked = 0, saturated = 0, not_finite = 0;
  std::size_t not_shown = 0;  ///< at an edge, off every surface, on a surface of weight 0
};

/// A measurement of a scene, read and set up: the problem and what is held out of it.
struct SceneMeasurement {
  SceneMeasurementFile file;
  ShapedScene shaped;  ///< scene and model, where cameras and surfaces are now
  SceneFitProblem problem;
  std::vector<std::vector<BlockReading>> held_out;  ///< one a plane
  std::vector<PlaneCounts> counts;                  ///< one a plane
  std::vector<std::pair<int, int>> size_px;         ///< width and height of each plane

  const Scene& scene() const { return *shaped.scene; }
  const SceneModel& model() const { return *shaped.model; }
};

/// Reads scene, photographs, masks and curves; aggregates pixels into the means of what shows one
/// element. A block is left out if a quarter of its pixels cannot be used, or one is saturated:
/// what is clipped would bias its mean.
/// InputError names the file, and the measurement file's line where that is wrong; MismatchError
/// for a photograph of another size than its camera's, or without the scene's bands.
SceneMeasurement read_scene_fit(const SceneMeasurementFile& file, const Progress& progress = {});

/// Fits; where cameras or surfaces moved by more than half a pixel, pixels are sorted into readings
/// once more and fitted again. Where the file asks for the prediction's bound, fits once more with
/// it: at the fitted reflectances, per surface and plane, as a rectangular distribution (bound /
/// sqrt 3) that all of its pixels share.
SceneFit fit_measurement(SceneMeasurement& measurement, const ShapeFitOptions& options,
                         const Progress& progress = {});

/// Readings that were not fitted, as the fit predicts them; their u holds that of the reading, of
/// its region and of the fitted parameters.
std::vector<FittedReading> predict_held_out(const SceneFitProblem& problem,
                                            const std::vector<std::vector<BlockReading>>& held_out,
                                            const SceneFit& fit);

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
// What a measurement's file says of each unknown. Internal to this folder's sources.
#pragma once

#include "fit/scene_measurement_fit.h"

namespace truebox {

Hold hold_of(const std::string& word);

// Before the model is built; the scene takes the starting reflectances.
void choose_reflectances(SceneMeasurement& m, Scene& scene);
void choose_cameras(SceneMeasurement& m, const Scene& scene);
void choose_offsets(SceneMeasurement& m, const Scene& scene);
/// The roughness of each material's lobe, 0: none; the problem's choices of gloss.
std::vector<double> choose_gloss(SceneMeasurement& m, const Scene& scene);

void choose_emissions(SceneMeasurement& m);  ///< the model must be there
void choose_response(SceneMeasurement& m);   ///< the readings too

}  // namespace truebox

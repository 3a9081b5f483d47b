// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "radiometry/observer.h"
#include "transport/prediction.h"

namespace truebox::app {

/// Pictures of the finest grid's solution on its way: element by element as a camera sees them,
/// half as much work again between one and the next.
struct SnapshotOptions {
  std::filesystem::path folder;
  std::string camera;  ///< may be empty if the scene has one
  int width_px = 384;
  Observer observer;
};

/// For PredictOptions::watch_finest: PNGs and `snapshots.csv` (file, matrix passes) in the folder.
/// Exposure is the same in all of them: white is the brightest light straight from the lamps.
/// `scene` must outlive the result. InputError for an unknown camera.
std::function<std::function<void(double, const BandMatrix&)>(const PatchMesh&, const BandMatrix&)>
snapshots(const Scene& scene, const SnapshotOptions& options);

}  // namespace truebox::app

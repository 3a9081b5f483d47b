// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "adaptive/adapt_mesh.h"
#include "transport/predict_to_target.h"

namespace truebox {

/// How the meshes of a prediction came about.
struct AdaptReport {
  std::vector<AdaptStep> steps;
  FollowedLines lines;
};

/// A prediction on adapted meshes: about `options.elements` elements on its finest grid, which is
/// the adapted mesh with every element cut in four; then the adapted mesh itself; and its coarser
/// forebear. The first two are edges h and 2h everywhere, so that the bound sees every element.
/// With `discontinuities` all three follow lines of light and shadow.
std::unique_ptr<Prediction> predict_adaptively(const Scene& scene, const PredictOptions& options,
                                               const Goal& goal, AdaptReport* report = nullptr,
                                               bool discontinuities = false);

}  // namespace truebox

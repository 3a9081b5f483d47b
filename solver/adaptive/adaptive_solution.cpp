// SPDX-License-Identifier: BSD-3-Clause
#include "adaptive/adaptive_solution.h"

namespace truebox {

std::unique_ptr<Prediction> predict_adaptively(const Scene& scene, const PredictOptions& options,
                                               const Goal& goal, AdaptReport* report,
                                               bool discontinuities) {
  AdaptOptions adapt;
  adapt.cells = std::max<std::size_t>(1, options.elements / 4);
  adapt.goal = goal;
  adapt.discontinuities = discontinuities;
  adapt.form_factors = options.form_factors;
  AdaptedMesh adapted = adapt_mesh(scene, adapt);
  if (report) *report = {adapted.steps, adapted.lines};
  PredictOptions on_adapted = options;
  // What near sources add brings grids closer to each other than to the truth: the bound would not
  // hold (certified means of the lit cube).
  on_adapted.near_sources = false;
  on_adapted.form_factors.method = FormFactorMethod::exact_visibility;
  on_adapted.mesh_of_grid = [&adapted](int grid) {
    return grid == 0 ? adapted.coarse.mesh(0) : adapted.fine.mesh(grid - 1);
  };
  return std::make_unique<Prediction>(scene, on_adapted);
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "radiometry/progress.h"
#include "transport/element_tree.h"
#include "transport/gather.h"

namespace truebox {

/// Mean irradiance of every element straight from the luminaires, elements x bands, W m^-2 nm^-1.
/// Shafts between groups of elements and a luminaire leave each element the few blockers that may
/// hide a part: nothing between, closed form; hidden, 0; else exact visibility from Gauss points.
/// Rows in parallel, the same values on any number of threads.
BandMatrix mean_direct(const PatchMesh& mesh, const Scene& scene, const Gather& gather,
                       const ElementTree& tree, const ShaftCulling& culling,
                       const Progress& progress = {});

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "radiometry/observer.h"
#include "transport/prediction.h"

namespace truebox {

/// VTK XML unstructured grid for ParaView: one polygon an element, cell data radiosity and its
/// error bound (one component a band, W m^-2 nm^-1) and the surface's number.
std::string solution_vtu(const Prediction& prediction);

/// Binary glTF 2.0: one mesh a surface with the solution at its vertices. COLOR_0 is the linear
/// BT.709 colour of the radiance B / pi, scaled so that the brightest surface that does not shine
/// is 1 (the factor stands in the extras) and clamped; _RADIOSITY_<nm>NM and _ERROR_BOUND_<nm>NM
/// (decimal point as "_") hold every band, W m^-2 nm^-1. Materials are unlit: the light is in the
/// colours.
std::string solution_glb(const Prediction& prediction, const Observer& observer);

}  // namespace truebox

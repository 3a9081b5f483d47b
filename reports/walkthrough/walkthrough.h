// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "radiometry/observer.h"
#include "transport/prediction.h"

namespace truebox {

/// One offline HTML file that shows a solution in three dimensions: orbit and walk, exposure, one
/// band or all as colour, false colour with a scale bar, the mesh, and value and error bound of the
/// point looked at. Nothing is fetched; three.js is inside. Values are halves (0.05 % steps), error
/// bounds rounded to 1 %. `source` says what was solved.
/// Throws std::length_error for more than 2^31 samples (vertices x bands x 2).
std::string walkthrough_html(const Prediction& prediction, const Observer& observer,
                             const std::string& source);

}  // namespace truebox

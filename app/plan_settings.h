// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "planning/plan.h"
#include "prediction_options.h"

namespace truebox::app {

/// Plans for the target error, the goal (`automatic`) and the memory of these arguments.
/// InputError if the scene has no such camera or surface.
Plan plan_for(const Scene& scene, const PredictionArguments& wished);

/// The arguments that a plan asks for instead.
PredictionArguments applied(const Plan& plan, const PredictionArguments& wished);

/// The same in one, and the command line that does as much. InputError where the plan is to trace
/// paths, which radiosity cannot stand in for.
PredictionArguments planned(const Scene& scene, const PredictionArguments& wished,
                            std::string& command_line);

/// What to type for these settings: solve, or render where paths are to be traced.
std::string command_line(const Plan& plan, const PredictionArguments& applied);

}  // namespace truebox::app

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "prediction_options.h"

namespace truebox::app {

/// What `--basis` can be: the name of each polynomial degree, from "constant" on.
std::vector<std::string> basis_names();

/// `solve --basis linear` and above: radiosity as polynomials on elements (Galerkin), means of the
/// surfaces with a bound that rests on no order of convergence, to the terminal and `output`
/// (.json); on more elements until a target error is met. InputError for options that only constant
/// elements have. Returns an exit code.
int solve_on_basis(const PredictionArguments& arguments, const std::string& output);

}  // namespace truebox::app

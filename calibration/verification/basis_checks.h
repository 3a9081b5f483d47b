// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "verification/accuracy_check.h"

namespace truebox {

/// Polynomial bases against the continuum: long strips and wedges (radiosity.csv) and the cube lit
/// by its ceiling (ceiling_lit_cube.csv). Allowed is the program's own bound.
std::vector<AccuracyCheck> check_bases(const std::filesystem::path& reference_dir);
std::vector<AccuracyCheck> check_strips(const std::filesystem::path& reference_dir);
std::vector<AccuracyCheck> check_cube_continuum(const std::filesystem::path& reference_dir);

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace truebox {

/// What is wrong with the includes of one file, a sentence each; `path` is relative to the
/// checkout ("solver/mesh/patch_mesh.h"), which says the module it belongs to.
std::vector<std::string> include_violations(const std::string& path, const std::string& text);

/// The same for every .h and .cpp under solver, reference, calibration and reports.
std::vector<std::string> include_violations_of_tree(const std::filesystem::path& checkout,
                                                    std::size_t& files_read);

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace truebox::app {

/// All of a file. Throws InputError if it cannot be read.
std::string read_text(const std::string& path);

}  // namespace truebox::app

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>

namespace truebox {

/// Told the stage at work and its share done, in [0, 1]; from any thread, one call at a time.
using Progress = std::function<void(const std::string& stage, double share)>;

}  // namespace truebox

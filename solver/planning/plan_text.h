// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>

namespace truebox::plan_text {

/// Numbers as sentences of a plan show them.
std::string percent(double share);
std::string seconds(double s);
std::string mebibytes(double bytes);
std::string count(double n);
std::string count(std::size_t n);

}  // namespace truebox::plan_text

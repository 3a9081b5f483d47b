// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>

namespace truebox {

struct TableFile;

/// The number behind "key=" in the column of parameters, such as "rho=0.5;E=1".
/// InputError if the key is not there.
double table_parameter(const TableFile& table, std::size_t row, const std::string& key);

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "verification/table_parameter.h"

#include <cstdlib>

#include "radiometry/input_error.h"
#include "radiometry/table_file.h"

namespace truebox {

double table_parameter(const TableFile& table, std::size_t row, const std::string& key) {
  const std::string& text = table.rows[row][1];
  const std::size_t at = text.find(key + "=");
  if (at == std::string::npos)
    throw InputError(table.path, table.row_lines[row], key + "=...", text);
  return std::strtod(text.c_str() + at + key.size() + 1, nullptr);
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "radiometry/tabulated_spectrum.h"

namespace truebox {

/// A comma-separated table: `# key: value` lines, one line of column names, then the rows.
/// Cells stay text until asked for, so that a mistake can name its line.
struct TableFile {
  std::string path;
  std::map<std::string, std::string> header;  ///< `# key: value`; repeated keys are joined by "; "
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;
  std::vector<int> row_lines;  ///< line number of each row in the file

  bool has_column(const std::string& name) const;
  std::size_t column_index(const std::string& name) const;   ///< InputError if there is none
  double number(std::size_t row, std::size_t column) const;  ///< InputError unless finite
};

/// Reads a table. InputError: missing file, no columns, a row of another length.
/// A cell may be quoted with ", a quote inside is doubled (RFC 4180).
TableFile read_table(const std::filesystem::path& path);

/// Column `column` against the first column (wavelength in nm).
/// InputError: unknown column, unsorted wavelengths, a cell that is no finite number.
TabulatedSpectrum spectrum_from_table(const TableFile& table, const std::string& column);

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "radiometry/table_file.h"

#include <charconv>
#include <cmath>
#include <fstream>

#include "radiometry/input_error.h"

namespace truebox {
namespace {

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::vector<std::string> split_cells(const std::string& line) {
  std::vector<std::string> cells;
  std::string cell;
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (c == '"') {
      if (quoted && i + 1 < line.size() && line[i + 1] == '"')
        cell += line[++i];
      else
        quoted = !quoted;
    } else if (c == ',' && !quoted) {
      cells.push_back(trimmed(cell));
      cell.clear();
    } else {
      cell += c;
    }
  }
  cells.push_back(trimmed(cell));
  return cells;
}

void read_header_line(const std::string& line, std::map<std::string, std::string>& header) {
  const std::string text = trimmed(line.substr(1));
  const auto colon = text.find(':');
  if (colon == std::string::npos) return;
  std::string& value = header[trimmed(text.substr(0, colon))];
  if (!value.empty()) value += "; ";
  value += trimmed(text.substr(colon + 1));
}

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const auto& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

}  // namespace

bool TableFile::has_column(const std::string& name) const {
  for (const auto& column : columns)
    if (column == name) return true;
  return false;
}

std::size_t TableFile::column_index(const std::string& name) const {
  for (std::size_t i = 0; i < columns.size(); ++i)
    if (columns[i] == name) return i;
  throw InputError(path, 0, "a column \"" + name + "\"", "columns " + joined(columns));
}

double TableFile::number(std::size_t row, std::size_t column) const {
  const std::string& cell = rows[row][column];
  double value = 0.0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (error != std::errc() || end != cell.data() + cell.size() || !std::isfinite(value))
    throw InputError(path, row_lines[row], "a finite number in column \"" + columns[column] + "\"",
                     "\"" + cell + "\"");
  return value;
}

TableFile read_table(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file || std::filesystem::is_directory(path))
    throw InputError(path.string(), 0, "a readable table", "no such file");
  TableFile table;
  table.path = path.string();
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    if (number == 1 && line.starts_with("\xEF\xBB\xBF")) line.erase(0, 3);
    if (trimmed(line).empty()) continue;
    if (line[0] == '#') {
      read_header_line(line, table.header);
    } else if (table.columns.empty()) {
      table.columns = split_cells(line);
    } else {
      table.rows.push_back(split_cells(line));
      table.row_lines.push_back(number);
      if (table.rows.back().size() != table.columns.size())
        throw InputError(table.path, number, std::to_string(table.columns.size()) + " cells",
                         std::to_string(table.rows.back().size()));
    }
  }
  if (table.columns.empty())
    throw InputError(table.path, 0, "a line of column names", "an empty table");
  return table;
}

TabulatedSpectrum spectrum_from_table(const TableFile& table, const std::string& column) {
  const std::size_t index = table.column_index(column);
  std::vector<double> nm, values;
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    nm.push_back(table.number(row, 0));
    values.push_back(table.number(row, index));
    if (row > 0 && nm[row] <= nm[row - 1])
      throw InputError(table.path, table.row_lines[row],
                       "a wavelength above " + table.rows[row - 1][0] + " nm (sorted)",
                       table.rows[row][0]);
  }
  if (nm.empty()) throw InputError(table.path, 0, "at least one row", "none");
  return TabulatedSpectrum(std::move(nm), std::move(values));
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "probe_points.h"

#include "radiometry/input_error.h"
#include "radiometry/table_file.h"

namespace truebox::app {

std::vector<ProbePoint> read_points(const std::string& path, double metres_per_unit) {
  const TableFile table = read_table(path);
  std::size_t column[6];
  const char* const names[] = {"x", "y", "z", "nx", "ny", "nz"};
  for (int k = 0; k < 6; ++k) column[k] = table.column_index(names[k]);
  const std::size_t name = table.column_index("name");
  std::vector<ProbePoint> points;
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    ProbePoint point{table.rows[row][name], {}, {}};
    for (int k = 0; k < 3; ++k) {
      point.position_m[k] = metres_per_unit * table.number(row, column[k]);
      point.normal[k] = table.number(row, column[3 + k]);
    }
    if (point.normal.norm() < 1e-12)
      throw InputError(path, table.row_lines[row], "a normal with a length", "nx = ny = nz = 0");
    point.normal.normalize();
    points.push_back(std::move(point));
  }
  return points;
}

}  // namespace truebox::app

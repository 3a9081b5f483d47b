// SPDX-License-Identifier: BSD-3-Clause
#include "radiometry/observer.h"

#include <utility>

#include "radiometry/input_error.h"
#include "radiometry/table_file.h"

namespace truebox {

Observer read_observer(const std::filesystem::path& path, std::string name) {
  const TableFile table = read_table(path);
  if (table.columns.size() < 4)
    throw InputError(table.path, 0, "a wavelength and three colour matching functions",
                     std::to_string(table.columns.size()) + " columns");
  return Observer{std::move(name), spectrum_from_table(table, table.columns[1]),
                  spectrum_from_table(table, table.columns[2]),
                  spectrum_from_table(table, table.columns[3])};
}

std::vector<Tristimulus> band_weights(const WavelengthGrid& grid, const Observer& observer) {
  std::vector<Tristimulus> weights(grid.size());
  for (std::size_t b = 0; b < grid.size(); ++b) {
    const double centre = grid.centre_nm(b), width = grid.width_nm(b);
    weights[b] = {observer.x_bar.band_mean(centre, width) * width,
                  observer.y_bar.band_mean(centre, width) * width,
                  observer.z_bar.band_mean(centre, width) * width};
  }
  return weights;
}

Tristimulus tristimulus(const std::vector<double>& stimulus, const WavelengthGrid& grid,
                        const Observer& observer) {
  Tristimulus sum;
  const auto weights = band_weights(grid, observer);
  for (std::size_t b = 0; b < grid.size(); ++b) {
    sum.X += stimulus[b] * weights[b].X;
    sum.Y += stimulus[b] * weights[b].Y;
    sum.Z += stimulus[b] * weights[b].Z;
  }
  return sum;
}

LinearRgb linear_bt709(const Tristimulus& c) {
  return {3.2404542 * c.X - 1.5371385 * c.Y - 0.4985314 * c.Z,
          -0.9692660 * c.X + 1.8760108 * c.Y + 0.0415560 * c.Z,
          0.0556434 * c.X - 0.2040259 * c.Y + 1.0572252 * c.Z};
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "radiometry/wavelength_grid.h"

#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace truebox {

WavelengthGrid WavelengthGrid::from_centres(std::vector<double> centres_nm) {
  if (centres_nm.empty()) throw std::invalid_argument("a wavelength grid needs a band");
  for (std::size_t i = 0; i < centres_nm.size(); ++i) {
    if (!std::isfinite(centres_nm[i]) || centres_nm[i] <= 0.0)
      throw std::invalid_argument("a band centre must be a positive number of nm");
    if (i > 0 && centres_nm[i] <= centres_nm[i - 1])
      throw std::invalid_argument("band centres must increase; " + std::to_string(centres_nm[i]) +
                                  " nm follows " + std::to_string(centres_nm[i - 1]) + " nm");
  }
  WavelengthGrid grid;
  grid.centres_nm_ = std::move(centres_nm);
  const auto& c = grid.centres_nm_;
  grid.widths_nm_.assign(c.size(), 1.0);
  for (std::size_t i = 0; c.size() > 1 && i < c.size(); ++i) {
    const double left = i > 0 ? c[i] - c[i - 1] : c[1] - c[0];
    const double right = i + 1 < c.size() ? c[i + 1] - c[i] : left;
    grid.widths_nm_[i] = 0.5 * (left + right);
  }
  return grid;
}

WavelengthGrid WavelengthGrid::uniform(double from_nm, double to_nm, double step_nm) {
  if (!(step_nm > 0.0) || !(to_nm >= from_nm) || !std::isfinite(to_nm - from_nm))
    throw std::invalid_argument("bands need from <= to and a positive step");
  const double steps = (to_nm - from_nm) / step_nm;
  if (steps > 1e5) throw std::invalid_argument("more than 100000 bands");
  if (std::abs(steps - std::round(steps)) > 1e-6)
    throw std::invalid_argument("(to - from) must be a whole number of steps");
  std::vector<double> centres;
  for (int i = 0; i <= static_cast<int>(std::lround(steps)); ++i)
    centres.push_back(from_nm + i * step_nm);
  WavelengthGrid grid = from_centres(std::move(centres));
  grid.widths_nm_.assign(grid.size(), step_nm);
  return grid;
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "radiometry/lamp_weighting.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace truebox {
namespace {

// The lamp within one band.
TabulatedSpectrum part_of(const TabulatedSpectrum& lamp, double from_nm, double to_nm) {
  std::vector<double> knots = {from_nm}, values = {lamp.at(from_nm)};
  for (std::size_t i = 0; i < lamp.wavelengths_nm().size(); ++i)
    if (const double x = lamp.wavelengths_nm()[i]; x > from_nm && x < to_nm) {
      knots.push_back(x);
      values.push_back(lamp.values()[i]);
    }
  knots.push_back(to_nm);
  values.push_back(lamp.at(to_nm));
  return {std::move(knots), std::move(values)};
}

}  // namespace

WavelengthGrid equal_bands(double from_nm, double to_nm, std::size_t count) {
  if (count < 1 || !(from_nm > 0.0) || !(to_nm > from_nm) || !std::isfinite(to_nm))
    throw std::invalid_argument("bands need a number of 1 or more and 0 < from < to");
  const double width = (to_nm - from_nm) / static_cast<double>(count);
  return WavelengthGrid::uniform(from_nm + 0.5 * width, to_nm - 0.5 * width, width);
}

std::vector<double> lamp_weighted_means(const TabulatedSpectrum& spectrum,
                                        const WavelengthGrid& grid, const TabulatedSpectrum& lamp) {
  const auto negative = [](double v) { return v < 0.0; };
  if (lamp.empty() || std::any_of(lamp.values().begin(), lamp.values().end(), negative))
    throw std::invalid_argument("bands are weighted by a lamp that is nowhere negative");
  std::vector<double> means;
  for (std::size_t b = 0; b < grid.size(); ++b) {
    const double centre = grid.centre_nm(b), width = grid.width_nm(b);
    const TabulatedSpectrum light = part_of(lamp, centre - 0.5 * width, centre + 0.5 * width);
    const auto& values = light.values();
    const bool is_dark = std::all_of(values.begin(), values.end(), [](double v) { return v == 0; });
    means.push_back(is_dark ? spectrum.band_mean(centre, width) : spectrum.weighted_mean(light));
  }
  return means;
}

std::vector<Tristimulus> lamp_weighted_band_weights(const WavelengthGrid& grid,
                                                    const Observer& observer,
                                                    const TabulatedSpectrum& lamp) {
  const std::vector<double> x = lamp_weighted_means(observer.x_bar, grid, lamp);
  const std::vector<double> y = lamp_weighted_means(observer.y_bar, grid, lamp);
  const std::vector<double> z = lamp_weighted_means(observer.z_bar, grid, lamp);
  std::vector<Tristimulus> weights;
  for (std::size_t b = 0; b < grid.size(); ++b) {
    const double width = grid.width_nm(b);
    weights.push_back({x[b] * width, y[b] * width, z[b] * width});
  }
  return weights;
}

}  // namespace truebox

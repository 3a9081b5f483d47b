// SPDX-License-Identifier: BSD-3-Clause
#include "radiometry/tabulated_spectrum.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace truebox {

TabulatedSpectrum::TabulatedSpectrum(std::vector<double> wavelengths_nm, std::vector<double> values)
    : wavelengths_nm_(std::move(wavelengths_nm)), values_(std::move(values)) {
  if (wavelengths_nm_.empty() || wavelengths_nm_.size() != values_.size())
    throw std::invalid_argument("a spectrum needs as many values as wavelengths, at least one");
  for (std::size_t i = 0; i < values_.size(); ++i) {
    if (!std::isfinite(values_[i]) || !std::isfinite(wavelengths_nm_[i]))
      throw std::invalid_argument("a spectrum's numbers must be finite");
    if (i > 0 && wavelengths_nm_[i] <= wavelengths_nm_[i - 1])
      throw std::invalid_argument("wavelengths must increase; " +
                                  std::to_string(wavelengths_nm_[i]) + " nm follows " +
                                  std::to_string(wavelengths_nm_[i - 1]) + " nm");
  }
}

double TabulatedSpectrum::at(double wavelength_nm) const {
  const auto& x = wavelengths_nm_;
  if (wavelength_nm <= x.front()) return values_.front();
  if (wavelength_nm >= x.back()) return values_.back();
  const std::size_t i =
      static_cast<std::size_t>(std::upper_bound(x.begin(), x.end(), wavelength_nm) - x.begin());
  const double t = (wavelength_nm - x[i - 1]) / (x[i] - x[i - 1]);
  return values_[i - 1] + t * (values_[i] - values_[i - 1]);
}

double TabulatedSpectrum::band_mean(double centre_nm, double width_nm) const {
  const double from = centre_nm - 0.5 * width_nm, to = centre_nm + 0.5 * width_nm;
  if (!(width_nm > 0.0)) return at(centre_nm);
  double sum = 0.0, x0 = from, y0 = at(from);
  auto knot = std::upper_bound(wavelengths_nm_.begin(), wavelengths_nm_.end(), from);
  for (; knot != wavelengths_nm_.end() && *knot < to; ++knot) {
    const double y1 = values_[static_cast<std::size_t>(knot - wavelengths_nm_.begin())];
    sum += 0.5 * (y0 + y1) * (*knot - x0);
    x0 = *knot;
    y0 = y1;
  }
  sum += 0.5 * (y0 + at(to)) * (to - x0);
  return sum / width_nm;
}

double TabulatedSpectrum::weighted_mean(const TabulatedSpectrum& weight) const {
  std::vector<double> knots = weight.wavelengths_nm();
  const double from = knots.front(), to = knots.back();
  for (double x : wavelengths_nm_)
    if (x > from && x < to) knots.push_back(x);
  std::sort(knots.begin(), knots.end());
  double product = 0.0, total = 0.0;
  for (std::size_t i = 1; i < knots.size(); ++i) {
    const double a = knots[i - 1], b = knots[i], h = b - a;
    const double fa = at(a), fb = at(b), wa = weight.at(a), wb = weight.at(b);
    // Simpson's rule is exact for the product of two straight lines.
    product += h / 6.0 * (fa * wa + (fa + fb) * (wa + wb) + fb * wb);
    total += 0.5 * h * (wa + wb);
  }
  if (total == 0.0) throw std::invalid_argument("the weight integrates to zero");
  return product / total;
}

bool TabulatedSpectrum::covers(double from_nm, double to_nm) const {
  return !empty() && wavelengths_nm_.front() <= from_nm && wavelengths_nm_.back() >= to_nm;
}

namespace {

// Spacing of the table where it is finest under a band: a line between coarse samples counts.
double finest_spacing_nm(const std::vector<double>& x, double from, double to) {
  double finest = 1e9;
  for (std::size_t i = 1; i < x.size(); ++i)
    if (x[i] > from && x[i - 1] < to) finest = std::min(finest, x[i] - x[i - 1]);
  return finest;
}

}  // namespace

std::vector<double> sample_bands(const TabulatedSpectrum& spectrum, const WavelengthGrid& grid) {
  std::vector<double> bands(grid.size());
  for (std::size_t b = 0; b < grid.size(); ++b) {
    const double centre = grid.centre_nm(b), width = grid.width_nm(b);
    const double spacing =
        finest_spacing_nm(spectrum.wavelengths_nm(), centre - 0.5 * width, centre + 0.5 * width);
    bands[b] = width <= 1.5 * spacing ? spectrum.at(centre) : spectrum.band_mean(centre, width);
  }
  return bands;
}

}  // namespace truebox

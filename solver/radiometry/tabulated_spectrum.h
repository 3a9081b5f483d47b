// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "radiometry/wavelength_grid.h"

namespace truebox {

/// A quantity sampled at wavelengths (nm, strictly increasing), linear in between.
/// Outside the table the end values hold, but `covers` says whether a band is really measured.
class TabulatedSpectrum {
 public:
  TabulatedSpectrum() = default;

  /// Throws std::invalid_argument on unequal lengths, an unsorted wavelength, a value that is not
  /// finite, or an empty table.
  TabulatedSpectrum(std::vector<double> wavelengths_nm, std::vector<double> values);

  double at(double wavelength_nm) const;

  /// Mean over the band [centre - width/2, centre + width/2]; exact for the piecewise-linear curve.
  double band_mean(double centre_nm, double width_nm) const;

  /// Mean of the product with a weight curve, integral(f w) / integral(w), over the weight's span;
  /// exact for piecewise-linear curves. Throws std::invalid_argument if the weight integrates to 0.
  double weighted_mean(const TabulatedSpectrum& weight) const;

  bool covers(double from_nm, double to_nm) const;
  bool empty() const { return wavelengths_nm_.empty(); }
  const std::vector<double>& wavelengths_nm() const { return wavelengths_nm_; }
  const std::vector<double>& values() const { return values_; }

 private:
  std::vector<double> wavelengths_nm_;
  std::vector<double> values_;
};

/// The value in each band: the point value at the centre where the table is as coarse as the band
/// (a sample is then a band value already), else the mean: lines between coarse samples count.
std::vector<double> sample_bands(const TabulatedSpectrum& spectrum, const WavelengthGrid& grid);

}  // namespace truebox

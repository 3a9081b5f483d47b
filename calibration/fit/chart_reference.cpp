// SPDX-License-Identifier: BSD-3-Clause
#include "fit/chart_reference.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "provenance/provenance.h"
#include "radiometry/table_file.h"

namespace truebox {
namespace {

// Ten times the filters' half width: all of the peak, none of the noise far from it.
constexpr double kPassBandHalfWidth_nm = 20.0;

TabulatedSpectrum shifted(const TabulatedSpectrum& spectrum, double by_nm) {
  std::vector<double> nm = spectrum.wavelengths_nm();
  for (double& x : nm) x += by_nm;
  return {nm, spectrum.values()};
}

TabulatedSpectrum peak_of(const TabulatedSpectrum& spectrum) {
  // Below 380 nm and above 780 nm the lamp is too weak for the ratio to mean anything.
  double peak_nm = 0.0, peak = -1.0;
  const auto& nm = spectrum.wavelengths_nm();
  for (std::size_t i = 0; i < nm.size(); ++i)
    if (nm[i] >= 380.0 && nm[i] <= 780.0 && spectrum.values()[i] > peak) {
      peak = spectrum.values()[i];
      peak_nm = nm[i];
    }
  std::vector<double> x, y;
  for (std::size_t i = 0; i < nm.size(); ++i)
    if (nm[i] >= 380.0 && std::abs(nm[i] - peak_nm) <= kPassBandHalfWidth_nm) {
      x.push_back(nm[i]);
      y.push_back(spectrum.values()[i]);
    }
  return {x, y};
}

double centroid_nm(const TabulatedSpectrum& spectrum) {
  const TabulatedSpectrum wavelength(spectrum.wavelengths_nm(), spectrum.wavelengths_nm());
  return wavelength.weighted_mean(spectrum);
}

}  // namespace

BandPass band_pass(const BandFiles& files, double centre_uncertainty_nm) {
  const TableFile table = read_table(files.transmission_path);
  require_provenance(table, Use::input);
  const TabulatedSpectrum measured = peak_of(spectrum_from_table(table, files.transmission_column));
  BandPass band;
  band.measured_centre_nm = centroid_nm(measured);
  band.stated_centre_nm = files.stated_centre_nm;
  const double apart = band.stated_centre_nm - band.measured_centre_nm;
  band.transmission = shifted(measured, 0.5 * apart);
  band.centre_nm = {band.measured_centre_nm + 0.5 * apart,
                    std::hypot(0.5 * apart / std::numbers::sqrt3, centre_uncertainty_nm)};
  return band;
}

BandReflectance band_reflectance(const TabulatedSpectrum& reflectance, const BandPass& band) {
  const auto at = [&](double shift_nm) {
    return reflectance.weighted_mean(shifted(band.transmission, shift_nm));
  };
  return {at(0.0), 0.5 * (at(1.0) - at(-1.0))};
}

}  // namespace truebox

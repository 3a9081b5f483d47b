// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "radiometry/estimate.h"
#include "radiometry/tabulated_spectrum.h"
#include "readings/chart.h"
#include "readings/measurement_file.h"

namespace truebox {

/// What light a band lets through: the filter's measured pass band, moved to its likely centre.
/// The transmission was measured with the filter hand-held in an uncollimated beam, which shifts an
/// interference filter to shorter wavelengths; the maker's centre holds for normal incidence. The
/// truth lies between: the centre is the middle, its uncertainty that of a rectangle as wide as the
/// two are apart, combined with the file's centre_uncertainty_nm (lamp x sensor unknown).
struct BandPass {
  TabulatedSpectrum transmission;   ///< shifted; only +-20 nm about the peak
  double measured_centre_nm = 0.0;  ///< centroid of the transmission as measured
  double stated_centre_nm = 0.0;
  Estimate centre_nm;
};

BandPass band_pass(const BandFiles& files, double centre_uncertainty_nm);

/// Reflectance weighted with the pass band, and its slope against the centre, 1/nm.
struct BandReflectance {
  double value = 0.0;
  double slope_per_nm = 0.0;
};
BandReflectance band_reflectance(const TabulatedSpectrum& reflectance, const BandPass& band);

}  // namespace truebox

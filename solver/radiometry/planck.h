// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace truebox {

/// Exitance of a black body at one wavelength, W m^-2 nm^-1; 0 at 0 K.
///   M = 2 pi h c^2 / (lambda^5 (exp(h c / (lambda k T)) - 1)).
/// std::invalid_argument unless wavelength > 0 and temperature >= 0, both finite.
/// Constants: SI (2019), exact. Source: Planck (1901).
double planck_exitance(double wavelength_nm, double temperature_K);

/// Its mean over a band, W m^-2 nm^-1, relative error below 1e-12. Errors as above.
double mean_planck_exitance(double from_nm, double to_nm, double temperature_K);

/// Over all wavelengths, W m^-2: sigma T^4. Source: Stefan (1879), Boltzmann (1884).
double blackbody_exitance(double temperature_K);

/// Stefan-Boltzmann constant 2 pi^5 k^4 / (15 h^3 c^2), W m^-2 K^-4.
double stefan_boltzmann_constant();

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "radiometry/planck.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace truebox {
namespace {

constexpr double kPlanck = 6.62607015e-34;     // J s
constexpr double kBoltzmann = 1.380649e-23;    // J/K
constexpr double kSpeedOfLight = 299792458.0;  // m/s

void require(double wavelength_nm, double temperature_K) {
  if (!(wavelength_nm > 0.0 && std::isfinite(wavelength_nm)))
    throw std::invalid_argument("a wavelength must be positive and finite");
  if (!(temperature_K >= 0.0 && std::isfinite(temperature_K)))
    throw std::invalid_argument("a temperature must be finite and not below 0 K");
}

}  // namespace

double planck_exitance(double wavelength_nm, double temperature_K) {
  require(wavelength_nm, temperature_K);
  if (temperature_K == 0.0) return 0.0;
  const double metres = 1e-9 * wavelength_nm;
  const double x = kPlanck * kSpeedOfLight / (metres * kBoltzmann * temperature_K);
  const double factor = 2.0 * std::numbers::pi * kPlanck * kSpeedOfLight * kSpeedOfLight;
  return 1e-9 * factor / std::pow(metres, 5) / std::expm1(x);
}

double mean_planck_exitance(double from_nm, double to_nm, double temperature_K) {
  require(from_nm, temperature_K);
  require(to_nm, temperature_K);
  if (!(from_nm < to_nm)) throw std::invalid_argument("a band must end above its start");
  // Boole's rule in the logarithm of the wavelength; e-folds of x = hc / (lambda k T) set the step.
  const double x = temperature_K > 0.0
                       ? kPlanck * kSpeedOfLight / (1e-9 * from_nm * kBoltzmann * temperature_K)
                       : 0.0;
  const double span = std::log(to_nm / from_nm);
  const auto panels = static_cast<int>(std::ceil(span * 40.0 * (1.0 + std::min(x, 700.0) / 10.0)));
  const double step = span / panels;
  double sum = 0.0;
  for (int p = 0; p < panels; ++p) {
    static constexpr double kWeights[] = {7, 32, 12, 32, 7};
    for (int k = 0; k < 5; ++k) {
      const double at = from_nm * std::exp(step * (p + 0.25 * k));
      sum += kWeights[k] / 90.0 * step * at * planck_exitance(at, temperature_K);
    }
  }
  return sum / (to_nm - from_nm);
}

double stefan_boltzmann_constant() {
  return 2.0 * std::pow(std::numbers::pi, 5) * std::pow(kBoltzmann, 4) /
         (15.0 * std::pow(kPlanck, 3) * kSpeedOfLight * kSpeedOfLight);
}

double blackbody_exitance(double temperature_K) {
  require(1.0, temperature_K);
  return stefan_boltzmann_constant() * std::pow(temperature_K, 4);
}

}  // namespace truebox

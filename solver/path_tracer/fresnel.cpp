// SPDX-License-Identifier: BSD-3-Clause
#include "path_tracer/fresnel.h"

#include <cmath>
#include <complex>

namespace truebox {

double fresnel_dielectric(double cos_incident, double relative_index) {
  const double eta = relative_index, sin2 = (1.0 - cos_incident * cos_incident) / (eta * eta);
  if (sin2 >= 1.0) return 1.0;
  const double cos_far = std::sqrt(1.0 - sin2);
  const double s = (cos_incident - eta * cos_far) / (cos_incident + eta * cos_far);
  const double p = (eta * cos_incident - cos_far) / (eta * cos_incident + cos_far);
  return 0.5 * (s * s + p * p);
}

double fresnel_conductor(double cos_incident, double n, double k) {
  const std::complex<double> eta(n, k);
  const std::complex<double> far =
      std::sqrt(1.0 - (1.0 - cos_incident * cos_incident) / (eta * eta));
  const auto s = (cos_incident - eta * far) / (cos_incident + eta * far);
  const auto p = (eta * cos_incident - far) / (eta * cos_incident + far);
  return 0.5 * (std::norm(s) + std::norm(p));
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <numbers>
#include <utility>
#include <vector>

namespace truebox {

/// One value a band of a quantity Q, in Q's unit. The grid is kept beside it, by the owner.
/// Different quantities do not convert into one another: a named function is the only door.
template <class Q>
struct Spectral {
  std::vector<double> values;

  Spectral() = default;
  explicit Spectral(std::vector<double> v) : values(std::move(v)) {}
  Spectral(std::size_t bands, double value) : values(bands, value) {}

  static constexpr const char* unit() { return Q::unit; }
  std::size_t size() const { return values.size(); }
  double& operator[](std::size_t band) { return values[band]; }
  double operator[](std::size_t band) const { return values[band]; }
};

// Quantities and units of ISO 80000-7:2019; per-wavelength quantities per nm.
struct ReflectanceQuantity {
  static constexpr const char* unit = "1";
};
struct RefractiveIndexQuantity {  // ISO 80000-7, 7-5; real part or absorption index
  static constexpr const char* unit = "1";
};
struct RadiantExitanceQuantity {
  static constexpr const char* unit = "W m^-2 nm^-1";
};
struct RadiosityQuantity {
  static constexpr const char* unit = "W m^-2 nm^-1";
};
struct IrradianceQuantity {
  static constexpr const char* unit = "W m^-2 nm^-1";
};
struct RadianceQuantity {
  static constexpr const char* unit = "W m^-2 sr^-1 nm^-1";
};

using Reflectance = Spectral<ReflectanceQuantity>;
using RefractiveIndex = Spectral<RefractiveIndexQuantity>;
using RadiantExitance = Spectral<RadiantExitanceQuantity>;
using Radiosity = Spectral<RadiosityQuantity>;  ///< leaving exitance, emitted + reflected
using Irradiance = Spectral<IrradianceQuantity>;
using Radiance = Spectral<RadianceQuantity>;

/// L = B / pi, the radiance of a Lambertian surface of radiosity B; the only door between the two.
inline Radiance lambertian_radiance(const Radiosity& radiosity) {
  Radiance radiance(radiosity.values);
  for (double& v : radiance.values) v /= std::numbers::pi;
  return radiance;
}
static_assert(!std::is_convertible_v<Radiosity, Radiance>);
static_assert(!std::is_convertible_v<Irradiance, Radiosity>);

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "sensor/spectral_responsivity.h"

#include <algorithm>
#include <stdexcept>

#include "transport/quadrature.h"

namespace truebox {
namespace {

constexpr double kPlanck_Js = 6.62607015e-34;
constexpr double kLightSpeed_m_per_s = 299792458.0;
constexpr double kNmToM = 1e-9;

double photons_per_joule(double nm) { return nm * kNmToM / (kPlanck_Js * kLightSpeed_m_per_s); }

void add_knots(const TabulatedSpectrum& curve, double from, double to, std::vector<double>& knots) {
  for (double nm : curve.wavelengths_nm())
    if (nm > from && nm < to) knots.push_back(nm);
}

}  // namespace

TabulatedSpectrum luminaire_spectrum(const Scene& scene) {
  std::vector<double> knots, values;
  for (const Material& material : scene.materials)
    if (!material.exitance_spectrum.empty())
      knots.insert(knots.end(), material.exitance_spectrum.wavelengths_nm().begin(),
                   material.exitance_spectrum.wavelengths_nm().end());
  std::sort(knots.begin(), knots.end());
  knots.erase(std::unique(knots.begin(), knots.end()), knots.end());
  if (knots.empty()) return TabulatedSpectrum({550.0}, {1.0});
  values.assign(knots.size(), 0.0);
  for (const Surface& surface : scene.surfaces) {
    const TabulatedSpectrum& exitance = scene.material_of(surface).exitance_spectrum;
    if (exitance.empty()) continue;
    double area_m2 = 0.0;
    for (const Polygon& piece : surface.pieces) area_m2 += area_vector(piece).norm();
    for (std::size_t i = 0; i < knots.size(); ++i)  // a measured table may dip below zero
      values[i] += area_m2 * std::max(0.0, exitance.at(knots[i]));
  }
  return TabulatedSpectrum(std::move(knots), std::move(values));
}

std::vector<double> band_responsivity(const std::vector<TabulatedSpectrum>& factors,
                                      const WavelengthGrid& bands, const TabulatedSpectrum& lamp) {
  for (double value : lamp.values())
    if (value < 0.0) throw std::invalid_argument("a lamp's spectrum is not negative");
  // Between knots the integrand is a polynomial: one degree a factor, wavelength and lamp.
  const int points = static_cast<int>(factors.size() + 2) / 2 + 1;
  if (factors.size() > 12) throw std::invalid_argument("more than 12 factors of a responsivity");
  const GaussRule& rule = gauss_rule(points);
  std::vector<double> weights(bands.size());
  for (std::size_t b = 0; b < bands.size(); ++b) {
    const double width = bands.width_nm(b);
    const double from = bands.centre_nm(b) - 0.5 * width, to = bands.centre_nm(b) + 0.5 * width;
    std::vector<double> knots = {from, to};
    add_knots(lamp, from, to, knots);
    for (const TabulatedSpectrum& factor : factors) add_knots(factor, from, to, knots);
    std::sort(knots.begin(), knots.end());
    double lit = 0.0, electrons = 0.0, electrons_flat = 0.0;
    for (std::size_t i = 1; i < knots.size(); ++i)
      for (std::size_t k = 0; k < static_cast<std::size_t>(points); ++k) {
        const double step = knots[i] - knots[i - 1], nm = knots[i - 1] + rule.nodes[k] * step;
        double eta = rule.weights[k] * step * photons_per_joule(nm);
        for (const TabulatedSpectrum& factor : factors) eta *= factor.at(nm);
        const double power = lamp.at(nm);
        lit += rule.weights[k] * step * power;
        electrons += eta * power;
        electrons_flat += eta;
      }
    weights[b] = lit > 0.0 ? width * electrons / lit : electrons_flat;
  }
  return weights;
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "scene/lamp_spectrum.h"

#include <set>
#include <utility>

#include "radiometry/lamp_weighting.h"

namespace truebox {

TabulatedSpectrum sum_of(const std::vector<TabulatedSpectrum>& spectra) {
  std::set<double> knots;
  for (const TabulatedSpectrum& spectrum : spectra)
    knots.insert(spectrum.wavelengths_nm().begin(), spectrum.wavelengths_nm().end());
  if (knots.empty()) return {};
  std::vector<double> sum;
  for (double nm : knots) {
    sum.push_back(0.0);
    for (const TabulatedSpectrum& spectrum : spectra) sum.back() += spectrum.at(nm);
  }
  return TabulatedSpectrum({knots.begin(), knots.end()}, std::move(sum));
}

TabulatedSpectrum lamp_spectrum(const Scene& scene) {
  std::vector<TabulatedSpectrum> lamps;
  for (const Material& material : scene.materials)
    if (!material.exitance_spectrum.empty()) lamps.push_back(material.exitance_spectrum);
  return sum_of(lamps);
}

std::vector<Tristimulus> display_weights(const Scene& scene, const Observer& observer) {
  const TabulatedSpectrum lamp = lamp_spectrum(scene);
  const auto& nm = lamp.empty() ? std::vector<double>{} : lamp.wavelengths_nm();
  const double first = scene.bands.centre_nm(0), last = scene.bands.centres_nm().back();
  std::size_t inside = 0;
  for (double x : nm) inside += x > first && x < last;
  return inside > scene.bands.size() ? lamp_weighted_band_weights(scene.bands, observer, lamp)
                                     : band_weights(scene.bands, observer);
}

}  // namespace truebox

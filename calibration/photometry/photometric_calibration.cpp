// SPDX-License-Identifier: BSD-3-Clause
#include "photometry/photometric_calibration.h"

#include <cmath>
#include <cstdio>

#include "photometry/calibration_frames.h"

namespace truebox {

PhotometricCalibration calibrate_photographs(const MeasurementFile& file,
                                             const CalibrationProgress& progress) {
  PhotometricCalibration calibration;
  calibration.file = file;
  if (progress) progress("read frames", 0.0);
  const auto frames = detail::read_calibration_frames(file);
  for (std::size_t c = 0; c < frames.channels; ++c) {
    InstrumentCalibration instrument = detail::calibrate_instrument(file, frames, c, progress);
    for (const auto& band : frames.bands) {
      if (band.channel != c) continue;
      if (progress) progress("merge " + band.name, 0.5);
      calibration.photographs.push_back(detail::linear_photograph(file, instrument, band));
    }
    calibration.instruments.push_back(std::move(instrument));
  }
  return calibration;
}

Image to_image(const LinearPhotograph& p, const MeasurementFile& file) {
  Image image(p.width, p.height);
  image.add_channel("value").samples = p.value;
  auto& variance = image.add_channel("variance").samples;
  for (std::size_t i = 0; i < variance.size(); ++i) variance[i] = p.u_noise[i] * p.u_noise[i];
  image.add_channel("u_noise").samples = p.u_noise;
  image.add_channel("u_common").samples = p.u_common;
  auto& exposures = image.add_channel("exposures").samples;
  exposures.assign(p.exposures_used.begin(), p.exposures_used.end());
  auto& flags = image.add_channel("flags").samples;
  flags.assign(p.flags.begin(), p.flags.end());
  image.attributes = {{"unit:value", p.unit},
                      {"unit:variance", "(" + p.unit + ")^2"},
                      {"unit:u_noise", p.unit},
                      {"unit:u_common", p.unit},
                      {"unit:exposures", "1"},
                      {"unit:flags", "1"},
                      {"bayer", file.instrument.mosaic ? file.instrument.bayer.name() : "none"},
                      {"band", p.band},
                      {"source", file.provenance.source}};
  return image;
}

std::string budget_text(const LinearPhotograph& p) {
  char line[160];
  std::string text;
  const auto add = [&](const char* kind, const std::string& name, double u) {
    const double relative =
        p.reference_value != 0.0 ? 100.0 * u / std::abs(p.reference_value) : 0.0;
    std::snprintf(line, sizeof line, "  %-7s %-38s %12.4g %9.3f %%\n", kind, name.c_str(), u,
                  relative);
    text += line;
  };
  std::snprintf(line, sizeof line,
                "%s: at %.5g %s, standard uncertainties (k = 1) of a photosite\n", p.band.c_str(),
                p.reference_value, p.unit.c_str());
  text += line;
  for (const auto& c : p.noise_budget.contributions()) add("noise", c.name, c.standard_uncertainty);
  for (const auto& c : p.common_budget.contributions())
    add("common", c.name, c.standard_uncertainty);
  add("noise", "combined", p.noise_budget.combined());
  add("common", "combined", p.common_budget.combined());
  add("", "both", std::hypot(p.noise_budget.combined(), p.common_budget.combined()));
  return text;
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "photometry/calibration_frames.h"
#include "radiometry/input_error.h"

namespace truebox::detail {
namespace {

// A normal reading passes it once in 10^9: of 10^8 photosites a tenth of one.
constexpr double kHot_sigma = 6.0;

std::vector<std::size_t> histogram(const std::vector<Frame>& frames,
                                   const std::vector<std::uint8_t>& excluded) {
  std::vector<std::size_t> counts;
  for (const Frame& frame : frames)
    for (std::size_t i = 0; i < frame.image.pixel_count(); ++i) {
      const float v = frame.image.channels[0].samples[i];
      if ((!excluded.empty() && excluded[i]) || !(v >= 0.0f && v < 4096.0f)) continue;
      const auto k = static_cast<std::size_t>(std::lround(v));
      if (counts.size() <= k) counts.resize(k + 1, 0);
      ++counts[k];
    }
  return counts;
}

/// A camera that states its black level and left no dark frames: the level is all that is known.
void add_stated_black(const std::vector<const BandFrames*>& bands, std::vector<MasterDark>& darks) {
  for (const BandFrames* band : bands)
    for (const Frame& frame : band->frames) {
      const auto black = frame.image.attributes.find("black_level_dn");
      if (black == frame.image.attributes.end() || matching_dark(darks, frame.exposure_s)) continue;
      MasterDark dark;
      dark.exposure_s = frame.exposure_s;
      dark.width = frame.image.width;
      dark.height = frame.image.height;
      dark.average_dn = std::stod(black->second);
      dark.mean_dn.assign(frame.image.pixel_count(), static_cast<float>(dark.average_dn));
      darks.push_back(std::move(dark));
    }
}

/// Every exposure gets its dark, measured or between two that were.
void complete_darks(const std::vector<double>& exposures_s, std::vector<MasterDark>& darks) {
  if (darks.empty()) return;
  const std::vector<MasterDark> measured = darks;
  for (double t : exposures_s)
    if (!matching_dark(darks, t)) darks.push_back(interpolated_dark(measured, t));
}

void find_defects(const CalibrationFrames& all, const std::vector<const BandFrames*>& bands,
                  const MeasurementFile& file, InstrumentCalibration& instrument) {
  DefectMap& defects = instrument.defects;
  for (const BandFrames* band : bands) mark_unusable(band->frames, all.mask, defects);
  const MasterDark* longest = nullptr;
  for (const MasterDark& dark : instrument.darks)
    if (!longest || dark.exposure_s > longest->exposure_s) longest = &dark;
  if (longest && longest->frames > 0) mark_hot(*longest, kHot_sigma, defects);
  // Any photosite may read alike in a few frames by chance; over all bands it may not.
  std::vector<Frame> lit;
  for (const BandFrames* band : bands)
    for (const Frame& frame : band->frames) lit.push_back(frame);
  BlockOptions options = block_options(file, instrument);
  mark_stuck(lit, options, std::max(file.instrument.step_dn, 1e-6), defects);
}

/// [group] of every sample: the band, or the pair's place where there is one band only.
struct Samples {
  std::vector<PairSample> all;
  std::vector<std::string> groups;
};

Samples noise_samples(const std::vector<const BandFrames*>& bands, const std::vector<Frame>* flats,
                      const BlockOptions& options) {
  Samples samples;
  const auto add = [&](const std::vector<Frame>& frames, const std::string& name) {
    const auto more = pair_samples(frames, samples.groups.size(), options);
    samples.groups.push_back(name);
    samples.all.insert(samples.all.end(), more.begin(), more.end());
  };
  for (const BandFrames* band : bands) {
    if (bands.size() > 1 || band->frames.size() < 3) {
      add(band->frames, band->name);
      continue;
    }
    const auto sorted = sorted_by_exposure(band->frames);
    for (std::size_t f = 0; f + 1 < sorted.size(); ++f)
      add({*sorted[f], *sorted[f + 1]},
          "exposures " + std::to_string(f + 1) + " and " + std::to_string(f + 2));
  }
  if (flats && flats->size() > 1) add(*flats, "flat field");
  return samples;
}

SiteNoise site_noise(char site, const Samples& samples, const Instrument& stated,
                     const std::string& path) {
  SiteNoise noise;
  noise.site = site;
  std::vector<PairSample> own;
  for (const PairSample& s : samples.all)
    if (s.site == site) own.push_back(s);
  noise.transfer = fit_photon_transfer(own);
  noise.given = stated.gain_dn && stated.read_noise_dn;
  if (!noise.transfer.found && !noise.given)
    throw InputError(path, 0,
                     "gain and read_noise in [instrument], or frames that show them (two exposures "
                     "of a still scene with unsaturated areas)",
                     noise.transfer.why_not);
  noise.model = noise.transfer.model;
  if (stated.gain_dn) noise.model.gain_dn = *stated.gain_dn;
  if (stated.read_noise_dn)
    noise.model.floor_dn2 = *stated.read_noise_dn * *stated.read_noise_dn +
                            stated.step_dn * stated.step_dn * kQuantisationVariance_dn2;
  std::size_t checked = 0;
  double sum = 0.0, squares = 0.0;
  for (std::size_t g = 0; g < samples.groups.size(); ++g) {
    std::vector<PairSample> in, out;
    for (const PairSample& s : own) (s.band == g ? out : in).push_back(s);
    if (out.empty()) continue;
    const PhotonTransfer others = noise.given ? noise.transfer : fit_photon_transfer(in);
    if (!others.found && !noise.given) continue;
    const NoiseCheck check = check_noise(noise.given ? noise.model : others.model, out);
    noise.held_out.push_back({samples.groups[g], check});
    const double n = static_cast<double>(check.samples);
    sum += n * check.chi2_per_dof;
    squares += n * n * check.u * check.u;
    checked += check.samples;
    noise.pooled.outliers += check.outliers;
  }
  noise.pooled.samples = checked;
  if (checked > 0) {
    noise.pooled.chi2_per_dof = sum / static_cast<double>(checked);
    noise.pooled.u = std::sqrt(squares) / static_cast<double>(checked);
  }
  return noise;
}

/// Frames of all bands in one list would be different scenes: curves are joined by band instead.
ResponseCurve recovered_curve(const std::vector<const BandFrames*>& bands,
                              const std::string& method) {
  const BandFrames* longest = bands.front();
  for (const BandFrames* band : bands)
    if (band->frames.size() > longest->frames.size()) longest = band;
  return recover_response(
      longest->frames, method == "debevec" ? ResponseMethod::debevec : ResponseMethod::robertson);
}

void find_response(const std::vector<const BandFrames*>& bands, const MeasurementFile& file,
                   InstrumentCalibration& instrument) {
  const std::string& choice = file.instrument.response;
  if (choice == "debevec" || choice == "robertson") {
    instrument.curve = recovered_curve(bands, choice);
    if (!instrument.curve.found)
      throw InputError(file.path, 0, "frames that show the camera's response",
                       instrument.curve.why_not);
    instrument.response = to_camera_response(instrument.curve);
    return;
  }
  std::vector<ExposureSeries> series;
  const BlockOptions options = block_options(file, instrument);
  for (const BandFrames* band : bands) {
    auto more = block_series(band->frames, options);
    std::move(more.begin(), more.end(), std::back_inserter(series));
  }
  instrument.linearity = estimate_response(series);
  if (choice == "fitted") instrument.response = instrument.linearity.response;
}

}  // namespace

BlockOptions block_options(const MeasurementFile& file, const InstrumentCalibration& instrument) {
  return {.saturation_dn = file.instrument.saturation_dn,
          .floor_dn = file.instrument.floor_dn,
          .block_px = instrument.labels.empty() ? 16 : 12,
          .response = instrument.response,
          .mosaic = file.instrument.mosaic,
          .bayer = file.instrument.bayer,
          .excluded = instrument.defects.flags,
          .labels = instrument.labels,
          .darks = &instrument.darks};
}

InstrumentCalibration calibrate_instrument(const MeasurementFile& file,
                                           const CalibrationFrames& frames, std::size_t channel,
                                           const CalibrationProgress& progress) {
  const auto tell = [&](const std::string& stage, double fraction) {
    if (progress) progress(stage, fraction);
  };
  InstrumentCalibration instrument;
  instrument.labels = frames.labels;
  std::vector<const BandFrames*> bands;
  std::vector<double> exposures_s;
  for (const BandFrames& band : frames.bands) {
    if (band.channel != channel) continue;
    bands.push_back(&band);
    for (const Frame& frame : band.frames) exposures_s.push_back(frame.exposure_s);
  }
  const std::vector<Frame>* flats = frames.flats.empty() ? nullptr : &frames.flats[channel];
  if (flats) exposures_s.push_back(file.flat.exposure_s);
  tell("dark frames and defects", 0.2);
  for (const auto& dark : frames.darks) instrument.darks.push_back(mean_dark(dark[channel]));
  if (instrument.darks.empty()) add_stated_black(bands, instrument.darks);
  complete_darks(exposures_s, instrument.darks);
  find_defects(frames, bands, file, instrument);
  tell("camera response", 0.3);
  find_response(bands, file, instrument);
  tell("photon transfer", 0.4);
  const BlockOptions options = block_options(file, instrument);
  const Samples samples = noise_samples(bands, flats, options);
  std::set<char> sites;
  for (int k = 0; k < 4; ++k) sites.insert(options.site(k % 2, k / 2));
  for (char site : sites)
    instrument.noise.push_back(site_noise(site, samples, file.instrument, file.path));
  double read_noise = 0.0;  // the smallest: a pooled dark is no quieter than its quietest colour
  for (const SiteNoise& noise : instrument.noise) {
    const double own = std::sqrt(std::max(
        noise.model.floor_dn2 - std::pow(file.instrument.step_dn, 2) * kQuantisationVariance_dn2,
        0.0));
    read_noise = read_noise > 0.0 ? std::min(read_noise, own) : own;
  }
  for (const auto& dark : frames.darks) {
    const auto counts = histogram(dark[channel], instrument.defects.flags);
    DarkDistribution both = fit_dark_distribution(counts);
    if (!both.found) both = fit_dark_distribution(counts, read_noise);
    instrument.dark_distributions.push_back(both);
  }
  if (flats) {
    tell("flat field", 0.45);
    const SiteNoise& first = instrument.noise.front();
    instrument.flat =
        flat_from_frames(*flats, matching_dark(instrument.darks, file.flat.exposure_s), first.model,
                         options, file.flat.uncertainty, file.path);
    mark_dead(instrument.flat.relative, options, instrument.flat.width, instrument.flat.height,
              instrument.defects);
    if (file.flat.model != "frames")
      instrument.flat =
          fitted_flat(instrument.flat, file.flat.model, block_options(file, instrument));
  }
  return instrument;
}

}  // namespace truebox::detail

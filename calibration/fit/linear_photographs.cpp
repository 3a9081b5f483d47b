// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "fit/chart_measurement.h"
#include "photometry/master_dark.h"
#include "radiometry/input_error.h"

namespace truebox {
namespace {

// Readings above this many DN tell of the curvature; a band that stays below says nothing.
constexpr double kCurvatureNeeds_dn = 100.0;

std::vector<Frame> read_frames(const BandFiles& band, const Chart& chart) {
  std::vector<Frame> frames;
  for (const FrameFile& file : band.photographs) {
    frames.push_back(read_frame(file.path, file.exposure_s));
    const Image& image = frames.back().image;
    if (image.width != chart.width || image.height != chart.height)
      throw MismatchError(file.path + " is " + std::to_string(image.width) + " x " +
                          std::to_string(image.height) + ", the label image " +
                          std::to_string(chart.width) + " x " + std::to_string(chart.height));
  }
  return frames;
}

/// Mean readings of each patch, photosites of one colour, exposures that nowhere leave the range.
std::vector<ExposureSeries> patch_series(const std::vector<Frame>& frames, char site,
                                         const std::vector<std::uint8_t>& labels,
                                         std::size_t patches, const Instrument& instrument) {
  std::vector<ExposureSeries> series(patches);
  for (const Frame& frame : frames) {
    std::vector<double> sum(patches, 0.0), top(patches, 0.0), low(patches, 1e9), n(patches, 0.0);
    const Image& image = frame.image;
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x) {
        const std::size_t i = image.index(x, y);
        if (labels[i] == 0 || instrument.bayer.site(x, y) != site) continue;
        const std::size_t p = labels[i] - std::size_t{1};
        const double v = image.channels[0].samples[i];
        sum[p] += v;
        top[p] = std::max(top[p], v);
        low[p] = std::min(low[p], v);
        n[p] += 1.0;
      }
    for (std::size_t p = 0; p < patches; ++p)
      if (n[p] > 0.0 && top[p] < instrument.saturation_dn && low[p] > instrument.floor_dn) {
        series[p].exposures_s.push_back(frame.exposure_s);
        series[p].readings_dn.push_back(sum[p] / n[p]);
      }
  }
  return series;
}

/// Photosites of one colour well inside a patch. Elsewhere the published frames mix clipped sensor
/// pixels into readings that do not look clipped: they were scaled down after the exposure.
std::vector<std::uint8_t> inner_photosites(std::vector<std::uint8_t> labels, int width,
                                           const BayerPattern& bayer, char site) {
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const int x = static_cast<int>(i) % width, y = static_cast<int>(i) / width;
    if (bayer.site(x, y) != site) labels[i] = 0;
  }
  return labels;
}

std::vector<MasterDark> read_darks(const MeasurementFile& file) {
  std::vector<MasterDark> darks;
  for (const DarkFiles& dark : file.darks) {
    std::vector<Frame> frames;
    for (const auto& path : dark.paths) frames.push_back(read_frame(path, dark.exposure_s));
    darks.push_back(mean_dark(frames));
  }
  return darks;
}

double standard_deviation(const std::vector<double>& values) {
  if (values.size() < 2) return 0.0;
  double mean = 0.0, sum = 0.0;
  for (double v : values) mean += v / static_cast<double>(values.size());
  for (double v : values) sum += (v - mean) * (v - mean);
  return std::sqrt(sum / static_cast<double>(values.size() - 1));
}

InstrumentEstimate estimate_instrument(const MeasurementFile& file,
                                       const std::vector<std::vector<Frame>>& frames,
                                       const std::vector<std::uint8_t>& labels) {
  InstrumentEstimate estimate;
  estimate.darks = read_darks(file);
  const std::size_t patches = file.chart.patches.size();
  std::vector<ExposureSeries> all;
  std::vector<NoiseSample> noise;
  std::vector<double> curvatures;
  for (std::size_t b = 0; b < frames.size(); ++b) {
    const auto series =
        patch_series(frames[b], file.bands[b].site, labels, patches, file.instrument);
    double top = 0.0;
    for (const auto& s : series)
      for (double reading : s.readings_dn) top = std::max(top, reading);
    if (top >= kCurvatureNeeds_dn)
      curvatures.push_back(estimate_response(series).response.curvature_per_dn.value);
    all.insert(all.end(), series.begin(), series.end());
    for (const Frame& frame : frames[b]) {
      const auto samples = second_difference_noise(frame, file.instrument.bayer, labels, patches,
                                                   file.instrument.saturation_dn);
      noise.insert(noise.end(), samples.begin(), samples.end());
    }
  }
  estimate.response = estimate_response(all);
  estimate.curvature_scatter_per_dn = standard_deviation(curvatures);
  estimate.noise = estimate_noise(noise);
  if (file.instrument.gain_dn) estimate.noise.gain_dn = *file.instrument.gain_dn;
  if (const auto read = file.instrument.read_noise_dn)
    estimate.noise.floor_dn2 = *read * *read + kQuantisationVariance_dn2;
  return estimate;
}

}  // namespace

LinearPhotographs merge_photographs(const MeasurementFile& file, const Chart& chart,
                                    const Progress& progress) {
  const auto tell = [&](const std::string& stage, double fraction) {
    if (progress) progress(stage, fraction);
  };
  std::vector<std::vector<Frame>> frames;
  for (std::size_t b = 0; b < file.bands.size(); ++b) {
    tell("read " + file.bands[b].name,
         0.3 * static_cast<double>(b) / static_cast<double>(file.bands.size()));
    frames.push_back(read_frames(file.bands[b], chart));
  }
  tell("camera response and noise", 0.3);
  LinearPhotographs linear;
  const auto labels = eroded_labels(chart, file.chart.margin_px);
  linear.instrument = estimate_instrument(file, frames, labels);
  MergeOptions options{.saturation_dn = file.instrument.saturation_dn,
                       .floor_dn = file.instrument.floor_dn,
                       .noise = linear.instrument.noise,
                       .response = linear.instrument.response.response,
                       .linearity_mask = {}};
  for (std::size_t b = 0; b < frames.size(); ++b) {
    tell("merge " + file.bands[b].name,
         0.35 + 0.25 * static_cast<double>(b) / static_cast<double>(frames.size()));
    options.linearity_mask =
        inner_photosites(labels, chart.width, file.instrument.bayer, file.bands[b].site);
    linear.bands.push_back(
        merge_exposures(frames[b], linear.instrument.darks, file.instrument.bayer, options));
    linear.bands.back().photograph.band = file.bands[b].name;
    linear.bands.back().photograph.provenance = file.provenance;
  }
  return linear;
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "photometry/calibration_frames.h"

#include "image/image_file.h"
#include "radiometry/input_error.h"
#include "readings/chart.h"

namespace truebox::detail {
namespace {

void require_same_size(const Frame& frame, const Frame& first) {
  const Image &a = frame.image, &b = first.image;
  if (a.width != b.width || a.height != b.height)
    throw MismatchError(frame.path + " is " + std::to_string(a.width) + " x " +
                        std::to_string(a.height) + ", " + first.path + " is " +
                        std::to_string(b.width) + " x " + std::to_string(b.height));
}

/// A RAW file says which colours its photosites have; the measurement must agree.
void require_same_mosaic(const Frame& frame, const MeasurementFile& file) {
  const auto own = frame.image.attributes.find("bayer");
  if (own == frame.image.attributes.end()) return;
  const std::string stated = file.instrument.mosaic ? file.instrument.bayer.name() : "none";
  if (own->second != stated)
    throw InputError(file.path, 0, "bayer = \"" + own->second + "\", as " + frame.path + " says",
                     "\"" + stated + "\"");
}

/// The frames of several files, [channel][frame].
std::vector<std::vector<Frame>> read_set(const std::vector<FrameFile>& files,
                                         const MeasurementFile& file, std::size_t& channels) {
  std::vector<std::vector<Frame>> set;
  for (const FrameFile& one : files) {
    auto frames = read_frame_channels(one.path, one.exposure_s);
    if (file.instrument.mosaic && frames.size() != 1)
      throw InputError(one.path, 0, "a mosaic of one channel (or bayer = \"none\")",
                       std::to_string(frames.size()) + " channels");
    require_same_mosaic(frames[0], file);
    if (channels == 0) channels = frames.size();
    if (frames.size() != channels)
      throw MismatchError(one.path + ": " + std::to_string(frames.size()) + " channels, not " +
                          std::to_string(channels));
    set.resize(channels);
    for (std::size_t c = 0; c < channels; ++c) set[c].push_back(std::move(frames[c]));
  }
  return set;
}

std::vector<FrameFile> with_exposure(const std::vector<std::string>& paths, double exposure_s) {
  std::vector<FrameFile> files;
  for (const auto& path : paths) files.push_back({path, exposure_s});
  return files;
}

}  // namespace

CalibrationFrames read_calibration_frames(const MeasurementFile& file) {
  CalibrationFrames all;
  all.channels = 0;
  for (const BandFiles& band : file.bands) {
    auto set = read_set(band.photographs, file, all.channels);
    for (std::size_t c = 0; c < set.size(); ++c) {
      const std::string channel = set[c][0].image.channels[0].name;
      all.bands.push_back(
          {set.size() > 1 ? band.name + "." + channel : band.name, &band, c, std::move(set[c])});
    }
  }
  if (all.bands.empty())
    throw InputError(file.path, 0, "at least one [[bands]] with photographs", "none");
  for (const DarkFiles& dark : file.darks)
    all.darks.push_back(read_set(with_exposure(dark.paths, dark.exposure_s), file, all.channels));
  if (!file.flat.paths.empty())
    all.flats = read_set(with_exposure(file.flat.paths, file.flat.exposure_s), file, all.channels);
  const Frame& first = all.bands[0].frames[0];
  for (const BandFrames& band : all.bands)
    for (const Frame& frame : band.frames) require_same_size(frame, first);
  for (const auto& dark : all.darks)
    for (const auto& channel : dark)
      for (const Frame& frame : channel) require_same_size(frame, first);
  for (const auto& channel : all.flats)
    for (const Frame& frame : channel) require_same_size(frame, first);
  if (!file.defect_mask.empty()) {
    const Image mask = read_image(file.defect_mask);
    all.mask = mask.channels[0].samples;
  }
  if (file.has_chart()) {
    const Chart chart =
        read_chart(file.chart.labels_path, file.chart.reflectance_path, file.chart.patches);
    if (chart.width != first.image.width || chart.height != first.image.height)
      throw MismatchError(first.path + " is " + std::to_string(first.image.width) + " x " +
                          std::to_string(first.image.height) + ", the label image " +
                          std::to_string(chart.width) + " x " + std::to_string(chart.height));
    all.labels = eroded_labels(chart, file.chart.margin_px);
  }
  return all;
}

}  // namespace truebox::detail

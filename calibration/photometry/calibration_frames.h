// SPDX-License-Identifier: BSD-3-Clause
// The stages behind calibrate_photographs. Internal to this folder.
#pragma once

#include <string>
#include <vector>

#include "photometry/photometric_calibration.h"

namespace truebox::detail {

/// One photograph to be: the frames of one band and channel.
struct BandFrames {
  std::string name;
  const BandFiles* files = nullptr;
  std::size_t channel = 0;
  std::vector<Frame> frames;
};

/// All frames of a measurement, channel by channel; sizes and channels agree throughout.
struct CalibrationFrames {
  std::vector<BandFrames> bands;
  std::vector<std::vector<std::vector<Frame>>> darks;  ///< [dark][channel][frame]
  std::vector<std::vector<Frame>> flats;               ///< [channel][frame]
  std::size_t channels = 1;
  std::vector<float> mask;
  std::vector<std::uint8_t> labels;  ///< of a chart's patches, eroded; empty without a chart
};
CalibrationFrames read_calibration_frames(const MeasurementFile& file);

BlockOptions block_options(const MeasurementFile& file, const InstrumentCalibration& instrument);

/// Dark, defects, response, noise and flat from the frames of one channel.
InstrumentCalibration calibrate_instrument(const MeasurementFile& file,
                                           const CalibrationFrames& frames, std::size_t channel,
                                           const CalibrationProgress& progress);

LinearPhotograph linear_photograph(const MeasurementFile& file,
                                   const InstrumentCalibration& instrument, const BandFrames& band);

}  // namespace truebox::detail

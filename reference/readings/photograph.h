// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "image/bayer.h"
#include "image/image.h"
#include "provenance/provenance.h"

namespace truebox {

/// One exposure as the camera delivered it: digital numbers (DN), not linearised.
struct Frame {
  std::string path;
  double exposure_s = 0.0;
  Image image;  ///< one channel
};

/// A linear photograph of one band, photosite by photosite (width x height, row by row).
/// `value` is proportional to the exposure rate; `variance` is that of `value`.
struct Photograph {
  std::string band;
  int width = 0, height = 0;
  BayerPattern bayer;
  std::vector<float> value;                  ///< DN s^-1
  std::vector<float> variance;               ///< DN^2 s^-2
  std::vector<std::uint8_t> exposures_used;  ///< 0: clipped in every exposure, `value` is a bound
  double shortest_s = 0.0, longest_s = 0.0;
  Provenance provenance;

  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(x);
  }
};

/// Reads one frame. InputError: unreadable, truncated, or more than one channel.
Frame read_frame(const std::filesystem::path& path, double exposure_s);

/// Reads one exposure of a camera that writes several channels: one frame a channel (R, G, B or
/// Y), an alpha channel left out; RAW mosaics and grey files are one frame. InputError as above.
std::vector<Frame> read_frame_channels(const std::filesystem::path& path, double exposure_s);

/// The photograph as an image with channels "value", "variance", "exposures" and unit attributes.
Image to_image(const Photograph& photograph);

}  // namespace truebox

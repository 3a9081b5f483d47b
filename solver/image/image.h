// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <vector>

namespace truebox {

/// A pixel position in px. Pixel (0, 0) is top left and its centre is (0.5, 0.5).
struct PixelPosition {
  double x_px = 0.0;
  double y_px = 0.0;
};

/// One named plane of width x height samples, row by row from the top left.
struct Channel {
  std::string name;
  std::vector<float> samples;
};

/// Named planes of equal size, with text attributes ("unit", "source", ...).
/// The unit of a channel's samples is attribute "unit", or "unit:<channel>" where they differ.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<Channel> channels;
  std::map<std::string, std::string> attributes;

  Image() = default;
  Image(int width_px, int height_px) : width(width_px), height(height_px) {}

  std::size_t pixel_count() const {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  }
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(x);
  }
  Channel& add_channel(std::string name, float value = 0.0f);
  const Channel* find(const std::string& name) const;  ///< nullptr if there is none
};

}  // namespace truebox

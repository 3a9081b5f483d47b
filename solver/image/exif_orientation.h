// SPDX-License-Identifier: BSD-3-Clause
// Internal to this folder.
#pragma once

#include <cstdint>
#include <span>
#include <utility>

namespace truebox {

/// Orientation, 1 to 8, in the content of a JPEG's APP1 segment; 0 if it is no Exif, damaged, or
/// says nothing. Source: CIPA DC-008-2019 (Exif 2.32), 4.6.4, tag 0x0112.
int exif_orientation(std::span<const std::uint8_t> app1);

/// Where a stored pixel stands when the picture is upright; width and height are as stored.
class Turn {
 public:
  Turn(int orientation, int width, int height)
      : orientation_(orientation), width_(width), height_(height) {}

  int width() const { return swaps() ? height_ : width_; }
  int height() const { return swaps() ? width_ : height_; }
  std::pair<int, int> upright(int x, int y) const;

 private:
  bool swaps() const { return orientation_ >= 5; }
  int orientation_, width_, height_;
};

}  // namespace truebox

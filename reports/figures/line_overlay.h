// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <string>
#include <vector>

#include "figures/false_colour.h"
#include "image/image.h"

namespace truebox {

/// A line drawn over a photograph, px of the photograph.
struct OverlayLine {
  PixelPosition from, to;
  std::array<std::uint8_t, 3> colour = {255, 255, 255};
};

/// A photograph as a backdrop, dimmed so that lines stand out, with lines drawn over it; averaged
/// down until no side exceeds `most_px`, or small ones doubled while none does. Display values
/// (attribute "transfer") are shown as they are, linear ones scaled to their 98 % quantile (a lamp
/// may be white) and coded as sRGB. Lines are one pixel wide, anti-aliased. Without channels R, G,
/// B the mean of all is shown as grey.
Picture line_overlay(const Image& photograph, const std::vector<OverlayLine>& lines, int most_px,
                     std::string note);

}  // namespace truebox

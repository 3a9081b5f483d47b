// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>

namespace truebox {

using Rgb8 = std::array<std::uint8_t, 3>;  ///< sRGB, 8 bit

/// Sequential map for t in [0, 1] (clamped): viridis, dark blue to yellow; its lightness rises
/// steadily, so that it also reads in grey and with every common colour vision.
/// Source: Smith, van der Walt (2015), matplotlib's viridis; sixth-degree fit by M. Zucker (CC0).
Rgb8 sequential_colour(double t);

/// Diverging map for t in [-1, 1] (clamped): blue below zero, neutral light grey at 0, red above,
/// equally light at +t and -t. Interpolated in the polar form Msh of CIELAB.
/// Source: Moreland (2009), Diverging Color Maps for Scientific Visualization, section 5.
Rgb8 diverging_colour(double t);

/// What is no number has its own colour, which neither map contains.
inline constexpr Rgb8 kNotFiniteColour = {255, 0, 255};

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace truebox {

/// A picture ready for a document: PNG bytes and, where its colours stand for numbers, the bar that
/// says which (SVG, drawn below the picture), with a note on what the colours cannot show.
struct Picture {
  std::vector<std::uint8_t> png;
  int width_px = 0;
  int height_px = 0;
  std::string scale_bar_svg;
  std::string note;
};

/// Values shown between two ends; what lies beyond takes the colour of the end and is counted.
struct ValueRange {
  double low = 0.0;
  double high = 1.0;
};

/// The finite values' range from quantile q to 1 - q (q = 0: all of them); {0, 1} if there are
/// none.
ValueRange value_range(std::span<const float> values, double q = 0.0);

/// The q-quantile of |v|: a limit for signed pictures, symmetric about zero. Never 0.
double symmetric_limit(std::span<const float> values, double q = 1.0);

/// A scalar field (width x height, row by row) in the sequential map. `quantity` and `unit` label
/// the bar: "radiance at 550 nm", "W m^-2 sr^-1 nm^-1". Throws std::invalid_argument on another
/// number of values or unless range.low < range.high.
Picture false_colour(int width, int height, std::span<const float> values, ValueRange range,
                     const std::string& quantity, const std::string& unit);

/// A signed field in the diverging map from -limit to +limit: grey is zero, red above, blue below.
Picture signed_false_colour(int width, int height, std::span<const float> values, double limit,
                            const std::string& quantity, const std::string& unit);

/// An 8-bit picture without numbers behind its colours (a photograph); `note` says how it was made.
Picture plain_picture(int width, int height, const std::vector<std::uint8_t>& rgb,
                      std::string note);

}  // namespace truebox

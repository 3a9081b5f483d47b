// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "radiometry/observer.h"

namespace truebox {

// Linear BT.709 and CIE XYZ to the digits at which both ways cancel. Source: ITU-R BT.709-6
// primaries, D65 of IEC 61966-2-1 (x = 0.3127, y = 0.3290).

inline constexpr Tristimulus kDisplayWhite = {0.950455927051672, 1.0, 1.08905775075988};

inline constexpr Tristimulus xyz_from_bt709(const LinearRgb& c) {
  return {0.412390799265959 * c[0] + 0.357584339383878 * c[1] + 0.180480788401834 * c[2],
          0.21263900587151 * c[0] + 0.715168678767756 * c[1] + 0.0721923153607337 * c[2],
          0.0193308187155918 * c[0] + 0.119194779794626 * c[1] + 0.950532152249661 * c[2]};
}

inline constexpr LinearRgb bt709_from_xyz(const Tristimulus& s) {
  return {3.24096994190452 * s.X - 1.53738317757009 * s.Y - 0.498610760293003 * s.Z,
          -0.96924363628088 * s.X + 1.87596750150772 * s.Y + 0.0415550574071756 * s.Z,
          0.0556300796969936 * s.X - 0.203976958888977 * s.Y + 1.05697151424288 * s.Z};
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "radiometry/observer.h"

namespace truebox {

/// CIE 1976 L*a*b* coordinates (dimensionless) against a stated white.
struct Lab {
  double L = 0.0, a = 0.0, b = 0.0;
};

/// CIELAB of a stimulus seen against `white` (same unit). Source: CIE 15:2018, 8.2.1.
/// Throws std::invalid_argument unless the white is positive.
Lab cielab(const Tristimulus& stimulus, const Tristimulus& white);

/// Colour difference dE00, kL = kC = kH = 1. About 1 is just visible on large neighbouring fields.
/// Fitted to surface colours with dE below 5: beyond that read it as "clearly different".
/// Source: Sharma, Wu, Dalal (2005), Color Research & Application 30(1), eqs (2)-(22).
double ciede2000(const Lab& first, const Lab& second);

}  // namespace truebox

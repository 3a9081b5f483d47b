// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "difference/metric_map.h"

namespace truebox {

/// Angle between the spectra of test and reference at each pixel, in degrees, over the spectral
/// bands of a map: the difference in colour that no change of exposure takes away. 0 where both
/// are black, 90 where one is. Source: Kruse et al. (1993), Remote Sens. Environ. 44, eq (1).
/// Throws std::invalid_argument if the map has fewer than two spectral bands.
MetricMap spectral_angle(const DifferenceMap& map);

}  // namespace truebox

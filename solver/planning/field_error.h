// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "transport/prediction.h"

namespace truebox {

/// What the irradiance that pictures show is off by: root mean square over the area of all
/// surfaces, relative to the mean irradiance, root mean square of the bands. From the differences
/// between the fields of the three grids; direct light is exact in all. With an error like h^p,
///   |e_h| = |f_h - f_2h| / (2^p - 1),   2^p = |f_2h - f_4h| / |f_h - f_2h|,   1.2 <= p <= 1.5,
/// 1.2 being the order that fine uniform elements have (tests/benchmark/links_or_matrix.cpp):
/// coarse ones fall faster, for a while. An estimate, not a bound.
double field_error(const Prediction& prediction);

}  // namespace truebox

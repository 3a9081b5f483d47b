// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "mesh/smooth_field.h"

namespace truebox {

/// max(|I_h - I_2h|, |I_2h - I_4h| / 2^p), entry by entry: the second guards against grids that
/// agree by chance, and does not bite where they converge with order p or more.
template <class Fine, class Coarse, class Coarsest>
auto guarded_difference(const Fine& fine, const Coarse& coarse, const Coarsest& coarsest,
                        double p) {
  return ((fine - coarse).cwiseAbs().cwiseMax(std::exp2(-p) * (coarse - coarsest).cwiseAbs()))
      .eval();
}

/// Gathered irradiance and means of surfaces: 1 + lambda, the singularity of edges in the source
/// and, averaged, in the weight; 1.6 at reflectance 0.8.
inline constexpr double kGatheredOrder = 1.5;

/// The smooth field at a point away from edges: second order at least.
inline constexpr double kSmoothOrder = 2.0;

/// 2^p - 1 of Richardson's extrapolation I_h + (I_h - I_2h) / (2^p - 1), p = 2: the observed order
/// 1.6 to 2 would move values further; edges keep it from being exact. Source: Richardson (1911).
inline constexpr double kRichardson = 3.0;

/// Rounding of a clipped Lambert sum, relative; measured below 1e-13.
inline constexpr double kRounding = 1e-12;

}  // namespace truebox

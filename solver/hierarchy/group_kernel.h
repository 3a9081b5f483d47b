// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "hierarchy/group_samples.h"

namespace truebox {

/// The kernel k(x, y) = max(0, cos_x) max(0, cos_y) / (pi r^2), m^-2, over all pairs of points of
/// two groups, nothing between.
struct KernelStatistics {
  double mean = 0.0;
  double spread = 0.0;    ///< standard deviation over the pairs
  double spread_a = 0.0;  ///< over the points of a, each averaged over b
  double spread_b = 0.0;
};

/// `offset_m` is the centre of b less that of a.
KernelStatistics kernel_statistics(const GroupSamples& a, const GroupSamples& b,
                                   const Vec3& offset_m);

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <span>

#include "transport/form_factor.h"
#include "transport/visible_parts.h"

namespace truebox {

/// The shadow pyramid of a blocker seen from one point, ready to be held against many sources.
struct ShadowCone {
  static constexpr int kMostEdges = 8;

  std::array<Vec3, kMostEdges> outward;  ///< normals of its sides, not normalised
  int edges = 0;
  Vec3 near_normal = Vec3::Zero();  ///< of the blocker, towards the point
  double distance_m = 0.0;          ///< of the point from the blocker's plane

  /// False if the blocker is seen edge-on or has too many edges.
  static bool make(const Vec3& point, const Blocker& blocker, ShadowCone& cone);
};

/// The hidden share of a small, far source seen from `point`, weighted with the kernel at the
/// centroids of its hidden parts: exact outlines, relative error of second order in size over
/// distance. The source lies wholly above the receiver's horizon. Negative if the parts became too
/// many or too cornered for the fixed memory: ask VisibleParts then.
double hidden_share(const Vec3& point, const Vec3& normal, const PlanarPolygon& source,
                    std::span<const ShadowCone* const> cones);

}  // namespace truebox

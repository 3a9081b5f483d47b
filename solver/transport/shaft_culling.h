// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/patch_mesh.h"
#include "transport/shaft.h"

namespace truebox {

/// One end of a shaft: points whose convex hull holds the surfaces there, and a plane with all that
/// these surfaces can see in front of it.
struct ShaftEnd {
  std::span<const Vec3> corners;  ///< at most 16, or shafts stay "partial"
  Plane horizon;
  Eigen::AlignedBox3d box;
  bool is_outline = true;  ///< corners are the outline of a flat polygon, in order

  /// Wholly behind what `plane` sees.
  bool is_behind(const Plane& plane, double tolerance_m) const;
};

/// Which pieces of a scene can come between two groups of surfaces. A walk down two trees hands the
/// blockers that are still in question from parent to child, on a stack. Sources as `shaft.h`.
class ShaftCulling {
 public:
  /// Without `occlusion` nothing blocks. The mesh must outlive this.
  ShaftCulling(const PatchMesh& mesh, const Scene& scene, bool occlusion);

  /// Pieces (into PatchMesh::pieces) that have something on both of their sides.
  const std::vector<std::uint32_t>& blockers() const { return blockers_; }

  /// Pushes those of stack[from, to) that may hide a part of the shaft; false if one hides it all.
  bool keep_between(const ShaftEnd& a, const ShaftEnd& b, std::vector<std::uint32_t>& stack,
                    std::size_t from, std::size_t to) const;

  double tolerance_m() const { return tolerance_m_; }

 private:
  double tolerance_m_;
  std::vector<std::uint32_t> blockers_;
  std::vector<ShaftBlocker> shaft_blockers_;  // one a piece
  std::vector<Eigen::AlignedBox3d> boxes_;
};

}  // namespace truebox

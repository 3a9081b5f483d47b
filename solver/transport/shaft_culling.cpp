// SPDX-License-Identifier: BSD-3-Clause
#include "transport/shaft_culling.h"

#include <algorithm>

namespace truebox {
namespace {

bool any_beyond(std::span<const Vec3> points, const Plane& plane, double sign, double tolerance_m) {
  return std::any_of(points.begin(), points.end(),
                     [&](const Vec3& v) { return sign * plane.distance_m(v) > tolerance_m; });
}

// Crossings of a polygon with a plane lie on its outline; of a box, on edges that are not listed.
bool may_cross_unlisted(const ShaftEnd& end, const Plane& plane) {
  return !end.is_outline && any_beyond(end.corners, plane, 1.0, 0.0) &&
         any_beyond(end.corners, plane, -1.0, 0.0);
}

}  // namespace

bool ShaftEnd::is_behind(const Plane& plane, double tolerance_m) const {
  return !any_beyond(corners, plane, 1.0, tolerance_m);
}

ShaftCulling::ShaftCulling(const PatchMesh& mesh, const Scene& scene, bool occlusion)
    : tolerance_m_(1e-9 * scene.diameter_m()) {
  for (std::uint32_t p = 0; p < mesh.pieces.size(); ++p) {
    const Piece& piece = mesh.pieces[p];
    shaft_blockers_.emplace_back(Blocker{piece.polygon, piece.plane});
    Eigen::AlignedBox3d& box = boxes_.emplace_back();
    for (const Vec3& v : piece.polygon) box.extend(v);
    if (!occlusion || scene.surfaces[piece.surface].is_opening) continue;
    bool front = false, behind = false;
    for (std::size_t q = 0; q < mesh.pieces.size() && !(front && behind); ++q) {
      front = front || any_beyond(mesh.pieces[q].polygon, piece.plane, 1.0, tolerance_m_);
      behind = behind || any_beyond(mesh.pieces[q].polygon, piece.plane, -1.0, tolerance_m_);
    }
    if (front && behind) blockers_.push_back(p);
  }
}

bool ShaftCulling::keep_between(const ShaftEnd& a, const ShaftEnd& b,
                                std::vector<std::uint32_t>& stack, std::size_t from,
                                std::size_t to) const {
  const Eigen::AlignedBox3d hull = a.box.merged(b.box);
  for (std::size_t k = from; k < to; ++k) {
    const std::uint32_t piece = stack[k];
    if (!hull.intersects(boxes_[piece])) continue;
    const Plane& plane = shaft_blockers_[piece].blocker.plane;
    if (may_cross_unlisted(a, plane) || may_cross_unlisted(b, plane)) {
      stack.push_back(piece);
      continue;
    }
    switch (shaft_occlusion(a.corners, a.horizon, b.corners, b.horizon, shaft_blockers_[piece],
                            tolerance_m_)) {
      case ShaftOcclusion::full: return false;
      case ShaftOcclusion::partial: stack.push_back(piece); break;
      case ShaftOcclusion::none: break;
    }
  }
  return true;
}

}  // namespace truebox

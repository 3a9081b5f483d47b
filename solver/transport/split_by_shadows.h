// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "transport/visible_parts.h"

namespace truebox {

/// What a point sees of a convex polygon, as VisibleParts, and what is hidden from it: a partition
/// of `source` into convex parts, cut no finer than the shadows ask for. Exact to rounding.
/// Sources: Nishita & Nakamae (1985); Weiler & Atherton (1977).
class SplitByShadows {
 public:
  /// The span is valid until the next call.
  std::span<const Polygon> operator()(const Vec3& point, std::span<const Vec3> source,
                                      const Plane& source_plane,
                                      std::span<const Blocker* const> blockers);

  /// What the blockers hid in the last call: with the visible parts, a partition of the source.
  std::span<const Polygon> hidden() const { return {hidden_.polygons.data(), hidden_.count}; }

 private:
  // Polygons that keep their memory from call to call.
  struct Pool {
    std::vector<Polygon> polygons;
    std::size_t count = 0;

    Polygon& add() {
      if (count == polygons.size()) polygons.emplace_back();
      return polygons[count++];
    }
  };

  void remove_shadow(const Vec3& point, const Blocker& blocker);
  void cut_part(const Vec3& point, const Plane& near, Polygon& part);

  Pool parts_, rest_, hidden_;
  std::vector<Plane> edges_;  // of the shadow pyramid, normals outward
  Polygon outside_, inside_;
};

}  // namespace truebox

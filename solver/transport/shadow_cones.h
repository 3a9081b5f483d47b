// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <memory>
#include <span>

#include "transport/convex_occluder.h"
#include "transport/form_factor.h"

namespace truebox {

/// What a solid hides from one point, ready to be held against many sources: the intersection of
/// half spaces, through the edges of its outline and behind the faces that the point sees.
struct ShadowCone {
  static constexpr int kMostPlanes = 24;
  enum class Hides { nothing, region, all };

  /// Unit normals and offsets of the planes; hidden is what lies behind all. Filled up to a
  /// multiple of four with planes that all is behind.
  alignas(32) std::array<double, kMostPlanes> x, y, z, offset_m;
  int count = 0;

  /// `all` from within the solid or from a face that looks into it. Region with count 0: too many
  /// planes.
  static Hides make(const Vec3& point, const Vec3& normal, const ConvexOccluder& solid,
                    double tolerance_m, ShadowCone& cone);

  double distance_m(int plane, const Vec3& v) const {
    const auto p = static_cast<std::size_t>(plane);
    return x[p] * v.x() + y[p] * v.y() + z[p] * v.z() - offset_m[p];
  }
};

enum class ShadowSide { outside, inside, across };

/// Whether a convex polygon lies in the shadow: `across` may still be outside, at a corner. Then
/// bit p of `cuts` says that plane p of the cone has corners in front.
struct ShadowTest {
  ShadowSide side = ShadowSide::outside;
  std::uint32_t cuts = 0;
};
ShadowTest test_shadow(const ShadowCone& cone, const PlanarPolygon& polygon);

/// Convex parts of a convex polygon that no cone hides, in fixed memory. Reusable.
class ShadowParts {
 public:
  ShadowParts();
  ShadowParts(ShadowParts&&) noexcept;
  ~ShadowParts();

  /// False if the parts became too many or too cornered: ask VisibleParts then.
  bool cut(std::span<const Vec3> source, std::span<const ShadowCone* const> cones);

  /// What a single cone hides of the source, its planes `cuts` alone; negative as `cut` is false.
  /// Otherwise as below.
  double hidden_share(const PlanarPolygon& source, const ShadowCone& cone, std::uint32_t cuts,
                      const Vec3& point, const Vec3& normal);

  /// Of the last cut, from `point`: hidden share by the kernel at centroids of parts, exactly 0 and
  /// 1 where nothing or all is hidden; relative error of second order in size over distance. The
  /// source lies wholly above the receiver's horizon.
  double hidden_share(const Vec3& point, const Vec3& normal, const Vec3& source_normal) const;

  /// Visible share of the source behind cones that all lie across it; `cuts` as test_shadow has
  /// them of the last. Near: by Lambert's formula, `whole` being that of all the source; else by
  /// the kernel at centroids, as above. Negative as `cut` is false.
  double visible_share(const PlanarPolygon& source, std::span<const ShadowCone* const> cones,
                       std::uint32_t cuts, const Vec3& point, const Vec3& normal, bool near,
                       double whole);

  /// Of the last cut: what the element sees of the source, by Lambert's formula.
  double visible_factor(const Vec3& point, const Vec3& normal) const;
  /// The same of what is hidden.
  double hidden_factor(const Vec3& point, const Vec3& normal) const;

 private:
  struct Memory;
  std::unique_ptr<Memory> memory_;
};

}  // namespace truebox

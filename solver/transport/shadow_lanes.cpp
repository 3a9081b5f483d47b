// SPDX-License-Identifier: BSD-3-Clause
#include "transport/shadow_lanes.h"

#include <algorithm>
#include <cmath>
#include <limits>

// Without fused products (-ffp-contract=off) all widths find the same bits.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define TRUEBOX_LANES_OF_EACH_WIDTH
#pragma GCC push_options
#pragma GCC target("arch=x86-64-v4")
namespace truebox::wide_512 {
namespace {
#include "transport/shadow_lanes.inl"
}
}  // namespace truebox::wide_512
#pragma GCC pop_options
#pragma GCC push_options
#pragma GCC target("arch=x86-64-v3")
namespace truebox::wide_256 {
namespace {
#include "transport/shadow_lanes.inl"
}
}  // namespace truebox::wide_256
#pragma GCC pop_options
#endif
namespace truebox::wide_128 {
namespace {
#include "transport/shadow_lanes.inl"
}
}  // namespace truebox::wide_128

namespace truebox {
namespace {

struct Functions {
  decltype(&wide_128::hidden_shares) hidden_shares = wide_128::hidden_shares;
  decltype(&wide_128::make_shadow) make_shadow = wide_128::make_shadow;
};

// What the machine has.
const Functions& functions() {
  static const Functions kFound = [] {
#ifdef TRUEBOX_LANES_OF_EACH_WIDTH
    if (__builtin_cpu_supports("x86-64-v4"))
      return Functions{wide_512::hidden_shares, wide_512::make_shadow};
    if (__builtin_cpu_supports("x86-64-v3"))
      return Functions{wide_256::hidden_shares, wide_256::make_shadow};
#endif
    return Functions{};
  }();
  return kFound;
}

}  // namespace

FlatSource::FlatSource(const PlanarPolygon& polygon) {
  const Polygon& p = polygon.vertices;
  u = (p[1] - p[0]).normalized();
  v = polygon.plane.normal.cross(u);
  corners = p.size() <= 4 ? 4 : kMostCorners;
  for (std::size_t k = 0; k < kMostCorners; ++k) {
    const Vec3 corner = p[std::min(k, p.size() - 1)] - polygon.centroid;
    corner_u[k] = corner.dot(u);
    corner_v[k] = corner.dot(v);
  }
}

bool LaneShadow::make(const LanePoints& points, const Vec3& normal, const ConvexOccluder& solid,
                      double tolerance_m) {
  constexpr std::size_t kMostFaces = 32;
  return solid.faces.size() <= kMostFaces &&
         functions().make_shadow(points, normal, solid, tolerance_m, *this);
}

bool hidden_shares(const LanePoints& points, const Vec3& normal, const PlanarPolygon& source,
                   const FlatSource& flat, std::span<const LaneShadow* const> shadows,
                   LaneShares& shares) {
  return functions().hidden_shares(points, normal, source, flat, shadows, shares);
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "transport/pair_kernel.h"
#include "transport/shadow_cones.h"
#include "transport/shadow_lanes.h"
#include "transport/visible_parts.h"

namespace truebox {

/// Finest of the product rules for partly hidden pairs, points a direction.
inline constexpr int kFinestOutlineOrder = 8;

/// What the quadrature points of one patch see: shadows of the occluders, made when asked for and
/// kept until the next patch. One a thread; the occluders outlive it.
class ReceiverView {
 public:
  /// From one point.
  struct Shadow {
    ShadowCone::Hides hides = ShadowCone::Hides::nothing;
    ShadowCone cone;
  };
  /// From eight points.
  struct Lanes {
    bool fits = false;  ///< false: too many planes
    LaneShadow shadow;
  };

  ReceiverView(const std::vector<ConvexOccluder>& occluders, double tolerance_m);

  void move_to(const PlanarPolygon& receiver);
  /// Looks from order x order points a quad from here on, order <= kFinestOutlineOrder.
  void take_points(int order);
  int order() const { return order_; }
  const PatchPoints& points() const { return rule().points; }
  /// The same points eight by eight.
  std::span<const LanePoints> lane_points() const { return rule().lanes; }

  /// One a point.
  std::span<const Shadow> shadows(std::uint32_t occluder);
  /// One a block of lane_points.
  std::span<const Lanes> lane_shadows(std::uint32_t occluder);

  ShadowParts parts;
  VisibleParts any_parts;  ///< where `parts` do not suffice

 private:
  template <class Kind>
  struct Entry {
    std::size_t age = 0;
    std::vector<Kind> shadows;
  };
  struct Rule {
    std::size_t age = 0;
    PatchPointBuffer buffer;
    PatchPoints points{};
    std::vector<LanePoints> lanes;
    std::vector<Entry<Shadow>> shadows;    // of each occluder
    std::vector<Entry<Lanes>> by_lanes;
  };

  const Rule& rule() const { return rules_[static_cast<std::size_t>(order_)]; }
  Rule& rule() { return rules_[static_cast<std::size_t>(order_)]; }

  const std::vector<ConvexOccluder>& occluders_;
  double tolerance_m_;
  int order_ = 2;
  const PlanarPolygon* receiver_ = nullptr;
  std::array<Rule, kFinestOutlineOrder + 1> rules_;
  std::size_t age_ = 0;
};

}  // namespace truebox

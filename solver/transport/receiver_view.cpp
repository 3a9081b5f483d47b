// SPDX-License-Identifier: BSD-3-Clause
#include "transport/receiver_view.h"

#include <algorithm>
#include <utility>

namespace truebox {
namespace {

// The last block is filled up with its last point, without weight.
void fill_lanes(const PatchPoints& points, std::vector<LanePoints>& lanes) {
  lanes.resize((points.count + kShadowLanes - 1) / kShadowLanes);
  for (std::size_t k = 0; k < lanes.size() * kShadowLanes; ++k) {
    const auto at = static_cast<std::uint32_t>(std::min<std::size_t>(k, points.count - 1));
    LanePoints& block = lanes[k / kShadowLanes];
    const std::size_t lane = k % kShadowLanes;
    const Vec3 x = points.at(at);
    block.x[lane] = x.x();
    block.y[lane] = x.y();
    block.z[lane] = x.z();
    block.weight_m2[lane] = k < points.count ? points.weight_at(at) : 0.0;
  }
}

}  // namespace

ReceiverView::ReceiverView(const std::vector<ConvexOccluder>& occluders, double tolerance_m)
    : occluders_(occluders), tolerance_m_(tolerance_m) {
  for (Rule& rule : rules_) {
    rule.shadows.resize(occluders.size());
    rule.by_lanes.resize(occluders.size());
  }
}

void ReceiverView::move_to(const PlanarPolygon& receiver) {
  if (receiver_ == &receiver) return;
  receiver_ = &receiver;
  ++age_;
}

void ReceiverView::take_points(int order) {
  order_ = order;
  Rule& taken = rule();
  if (std::exchange(taken.age, age_) == age_) return;
  taken.points = taken.buffer.fill(*receiver_, order);
  fill_lanes(taken.points, taken.lanes);
}

std::span<const ReceiverView::Shadow> ReceiverView::shadows(std::uint32_t occluder) {
  Entry<Shadow>& entry = rule().shadows[occluder];
  if (std::exchange(entry.age, age_) == age_) return entry.shadows;
  entry.shadows.resize(points().count);
  for (std::uint32_t k = 0; k < points().count; ++k)
    entry.shadows[k].hides =
        ShadowCone::make(points().at(k), receiver_->plane.normal, occluders_[occluder],
                         tolerance_m_, entry.shadows[k].cone);
  return entry.shadows;
}

std::span<const ReceiverView::Lanes> ReceiverView::lane_shadows(std::uint32_t occluder) {
  Entry<Lanes>& entry = rule().by_lanes[occluder];
  if (std::exchange(entry.age, age_) == age_) return entry.shadows;
  entry.shadows.resize(rule().lanes.size());
  for (std::size_t k = 0; k < entry.shadows.size(); ++k)
    entry.shadows[k].fits = entry.shadows[k].shadow.make(
        rule().lanes[k], receiver_->plane.normal, occluders_[occluder], tolerance_m_);
  return entry.shadows;
}

}  // namespace truebox

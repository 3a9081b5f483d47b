// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "transport/exact_form_factors.h"
#include "transport/exact_visibility.h"
#include "transport/pair_kernel.h"
#include "transport/pair_planner.h"
#include "transport/receiver_view.h"

namespace truebox {

/// A pair that something hides a part of; its occluders are a range of ids kept elsewhere.
struct PartialPair {
  std::uint32_t receiver = 0, source = 0, first_occluder = 0, occluders = 0;
};

/// Exchange areas of single pairs of a mesh without rays: kernel, planner, and what a partly hidden
/// pair sees of itself. Immutable, thread safe; each thread brings a view().
class ExactPairs {
 public:
  ExactPairs(const PatchMesh& mesh, const Scene& scene, const ExactFormFactorOptions& options);

  const std::vector<PlanarPolygon>& polygons() const { return polygons_; }
  const PairPlanner& planner() const { return planner_; }
  const PairKernel& kernel() const { return kernel_; }
  ReceiverView view() const { return ReceiverView(planner_.occluders(), tolerance_m_); }

  /// Who receives. Shadows move over the source d_source / d_receiver times as fast as a point over
  /// the receiver, d the distances from the occluder: the patch receives whose points see less of a
  /// change.
  PartialPair oriented(std::uint32_t i, std::uint32_t j,
                       std::span<const std::uint32_t> occluders) const;

  /// m^2; `view` stands at the receiver. Same for both directions, >= 0.
  double exchange_m2(const PartialPair& pair, std::span<const std::uint32_t> occluders,
                     ReceiverView& view) const;

 private:
  // Weighted with the kernel; roughness: what a finer rule may change.
  struct Share {
    double mean = 0.0, roughness = 0.0;
  };

  double adaptive_exchange_m2(const PartialPair& pair,
                              std::span<const std::uint32_t> occluders) const;
  std::vector<const Blocker*> members_of(std::span<const std::uint32_t> occluders) const;
  Share visible_share(const PartialPair& pair, std::span<const std::uint32_t> occluders,
                      ReceiverView& view) const;
  bool share_by_lanes(const PartialPair& pair, std::span<const std::uint32_t> occluders,
                      ReceiverView& view, Share& share) const;
  Share share_by_points(const PartialPair& pair, std::span<const std::uint32_t> occluders,
                        bool near, ReceiverView& view) const;
  double share_from(std::uint32_t k, double factor, bool near, const PartialPair& pair,
                    std::span<const std::uint32_t> occluders, ReceiverView& view) const;

  std::vector<PlanarPolygon> polygons_;
  std::vector<FlatSource> flat_;
  double tolerance_m_;
  PairPlanner planner_;
  PairKernel kernel_;
  ExactVisibilityOptions adaptive_;
  int outline_points_;
  double outline_tolerance_;
};

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "mesh/patch_mesh.h"
#include "transport/convex_occluder.h"
#include "transport/form_factor.h"

namespace truebox {

/// Sorts all pairs of patches into unoccluded, hidden and partly hidden by the shafts between them,
/// whole groups at once: patches of a piece form a tree of rectangles, and a shaft between two
/// rectangles that nothing enters, or that one solid closes, needs no look at its pairs.
/// Sources: Haines & Wallace (1994); Teller & Hanrahan (1993), hierarchical visibility.
class PairPlanner {
 public:
  struct Visitor {
    /// Nothing can stand between any of `i` and any of `j`, two runs of PairPlanner::order. If they
    /// do not face each other wholly, some may show each other their backs.
    std::function<void(std::span<const std::uint32_t> i, std::span<const std::uint32_t> j,
                       bool face_wholly)>
        unoccluded;
    /// `occluders` (into PairPlanner::occluders) may hide a part; none hides all.
    std::function<void(std::uint32_t i, std::uint32_t j, std::span<const std::uint32_t> occluders)>
        partial;
    /// One occluder hides each of the pairs.
    std::function<void(std::size_t pairs)> hidden;
  };

  /// Nodes that were measured against occluders, kept by one thread from visit to visit.
  class Memory {
   private:
    friend class PairPlanner;
    std::vector<std::uint32_t> place;  // in `ends`, of each node and occluder; 0: not measured
    std::vector<MeasuredEnd> ends;
    std::size_t used = 0;
  };

  /// Without `occlusion` every pair is unoccluded.
  PairPlanner(const PatchMesh& mesh, const Scene& scene, const std::vector<PlanarPolygon>& patches,
              double tolerance_m, bool occlusion);

  /// What can come between patches: solids of the scene's polygons that have something on both of
  /// their sides. Their members are indices into blockers().
  const std::vector<ConvexOccluder>& occluders() const { return occluders_; }
  const std::vector<Blocker>& blockers() const { return blockers_; }
  /// All patches, neighbours next to each other, those of a piece together and in pieces' order.
  std::span<const std::uint32_t> order() const { return order_; }
  std::size_t position_of(std::span<const std::uint32_t> run) const {
    return static_cast<std::size_t>(run.data() - order_.data());
  }

  /// Independent shares of the work: each pair of patches of different pieces is in one of them.
  std::size_t tasks() const { return tasks_.size(); }
  void visit(std::size_t task, Memory& memory, const Visitor& visitor) const;
  /// All pairs of one patch, as i, with every patch of other pieces.
  void visit_row(std::uint32_t patch, Memory& memory, const Visitor& visitor) const;

 private:
  struct Node {
    std::uint32_t begin = 0, end = 0;   // into order_
    std::uint32_t left = 0, right = 0;  // 0: a leaf
    std::uint32_t piece = 0;
    Polygon outline;  // the patch, or a rectangle about the patches
    Eigen::AlignedBox3d box;
    double size_m = 0.0;
  };
  struct Task {
    std::uint32_t a, b;
  };
  class Walk;

  void find_occluders(const Scene& scene);
  std::uint32_t make_node(std::uint32_t piece, std::uint32_t begin, std::uint32_t end,
                          const Vec3& u, const Vec3& v);

  const PatchMesh& mesh_;
  const std::vector<PlanarPolygon>& patches_;
  double tolerance_m_;
  std::vector<Blocker> blockers_;
  std::vector<ConvexOccluder> occluders_;
  std::vector<std::uint32_t> occluder_of_piece_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> root_;  // of each piece
  std::vector<std::uint32_t> leaf_;  // of each patch
  std::vector<Task> tasks_;
};

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "transport/direct_light.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <mutex>

#include "transport/enclosure.h"

namespace truebox {
namespace {

struct LampEnd {
  std::uint32_t piece;
  ShaftEnd end;
  Eigen::Map<const Eigen::RowVectorXd> exitance;
};

std::vector<LampEnd> ends_of_lamps(const PatchMesh& mesh, const Scene& scene) {
  std::vector<LampEnd> lamps;
  for (std::uint32_t p = 0; p < mesh.pieces.size(); ++p) {
    const Piece& piece = mesh.pieces[p];
    const Surface& surface = scene.surfaces[piece.surface];
    if (surface.is_opening || !scene.material_of(surface).emits()) continue;
    const auto& values = scene.material_of(surface).exitance.values;
    LampEnd lamp{p,
                 {piece.polygon, piece.plane, {}, true},
                 {values.data(), static_cast<Eigen::Index>(values.size())}};
    for (const Vec3& v : piece.polygon) lamp.end.box.extend(v);
    lamps.push_back(std::move(lamp));
  }
  return lamps;
}

// From one lamp to the elements below a node; blockers still in question are on a stack.
template <class Visit>
class Walk {
 public:
  Walk(const ElementTree& tree, const ShaftCulling& culling, const Visit& visit)
      : tree_(tree), culling_(culling), visit_(visit) {}

  void run(const ElementNode& node, const LampEnd& lamp) {
    stack_ = culling_.blockers();
    descend(node, lamp, 0);
  }

 private:
  void descend(const ElementNode& node, const LampEnd& lamp, std::size_t from) {
    const ShaftEnd end = node.end_of_shaft();
    if (end.is_behind(lamp.end.horizon, culling_.tolerance_m()) ||
        lamp.end.is_behind(end.horizon, culling_.tolerance_m()))
      return;
    const std::size_t to = stack_.size();
    if (culling_.keep_between(end, lamp.end, stack_, from, to)) {
      if (stack_.size() == to || node.is_leaf()) {
        for (std::uint32_t patch : tree_.patches_of(node))
          visit_(patch, lamp, std::span(stack_).subspan(to));
      } else {
        descend(tree_.nodes[node.left], lamp, to);
        descend(tree_.nodes[node.right], lamp, to);
      }
    }
    stack_.resize(to);
  }

  const ElementTree& tree_;
  const ShaftCulling& culling_;
  const Visit& visit_;
  std::vector<std::uint32_t> stack_;
};

// Each task starts from all blockers again: as few as keep the threads busy.
constexpr std::size_t kTasks = 64, kLeastElementsOfATask = 64;

void collect_tasks(const ElementTree& tree, std::uint32_t index, std::size_t elements_of_a_task,
                   std::vector<std::uint32_t>& tasks) {
  const ElementNode& node = tree.nodes[index];
  if (node.is_leaf() || node.end - node.begin <= elements_of_a_task) {
    tasks.push_back(index);
    return;
  }
  collect_tasks(tree, node.left, elements_of_a_task, tasks);
  collect_tasks(tree, node.right, elements_of_a_task, tasks);
}

}  // namespace

BandMatrix mean_direct(const PatchMesh& mesh, const Scene& scene, const Gather& gather,
                       const ElementTree& tree, const ShaftCulling& culling,
                       const Progress& progress) {
  BandMatrix direct = BandMatrix::Zero(static_cast<Eigen::Index>(mesh.size()),
                                       static_cast<Eigen::Index>(scene.bands.size()));
  const std::vector<LampEnd> lamps = ends_of_lamps(mesh, scene);
  std::vector<std::uint32_t> tasks;
  collect_tasks(tree, 0, std::max(kLeastElementsOfATask, tree.order.size() / kTasks), tasks);
  std::atomic<std::size_t> done{0};
  std::mutex progress_lock;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, tasks.size()), [&](const auto& range) {
    Gather::Scratch scratch;
    const auto add = [&](std::uint32_t patch, const LampEnd& lamp, auto between) {
      direct.row(patch) += gather.mean_factor(patch, lamp.piece, between, scratch) * lamp.exitance;
    };
    Walk walk(tree, culling, add);
    for (std::size_t t = range.begin(); t < range.end(); ++t)
      for (const LampEnd& lamp : lamps) walk.run(tree.nodes[tasks[t]], lamp);
    const std::size_t count = done += range.end() - range.begin();
    if (!progress) return;
    const std::lock_guard guard(progress_lock);
    progress("direct light", static_cast<double>(count) / static_cast<double>(tasks.size()));
  });
  return direct;
}

Eigen::RowVectorXd mean_direct_of_free_part(const PatchMesh& mesh, const Scene& scene,
                                            const Gather& gather, const Visibility& visibility,
                                            std::uint32_t patch) {
  constexpr int kPoints = 16;  // squared
  const Vec3& normal = mesh.plane_of(mesh.patches[patch]).normal;
  Polygon polygon;
  mesh.polygon_of(mesh.patches[patch], polygon);
  Gather::Scratch scratch;
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(scene.bands.size()));
  int free = 0;
  for (int k = 0; k < kPoints * kPoints; ++k) {
    const Vec3 point =
        sample_polygon(polygon, (k / kPoints + 0.5) / kPoints, (k % kPoints + 0.5) / kPoints);
    if (!is_free(mesh, scene, visibility, patch, point)) continue;
    gather.add_direct(point, normal, sum, scratch);
    ++free;
  }
  return sum.transpose() / std::max(1, free);
}

LitElements::LitElements(const PatchMesh& mesh, const Scene& scene, const ElementTree& tree,
                         const ShaftCulling& culling)
    : lamps_(mesh.size()), partly_hidden_(mesh.size(), 0) {
  const auto add = [&](std::uint32_t patch, const LampEnd& lamp, auto between) {
    lamps_[patch].push_back(
        {lamp.piece, lamp.exitance.transpose(), {between.begin(), between.end()}});
    partly_hidden_[patch] |= !between.empty();
  };
  Walk walk(tree, culling, add);
  for (const LampEnd& lamp : ends_of_lamps(mesh, scene)) walk.run(tree.nodes[0], lamp);
}

}  // namespace truebox

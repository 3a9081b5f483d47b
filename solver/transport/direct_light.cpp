// SPDX-License-Identifier: BSD-3-Clause
#include "transport/direct_light.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <mutex>

namespace truebox {
namespace {

struct Lamp {
  std::uint32_t piece;
  ShaftEnd end;
  Eigen::Map<const Eigen::RowVectorXd> exitance;
};

std::vector<Lamp> lamps_of(const PatchMesh& mesh, const Scene& scene) {
  std::vector<Lamp> lamps;
  for (std::uint32_t p = 0; p < mesh.pieces.size(); ++p) {
    const Piece& piece = mesh.pieces[p];
    const Surface& surface = scene.surfaces[piece.surface];
    if (surface.is_opening || !scene.material_of(surface).emits()) continue;
    const auto& values = scene.material_of(surface).exitance.values;
    Lamp lamp{p,
              {piece.polygon, piece.plane, {}, true},
              {values.data(), static_cast<Eigen::Index>(values.size())}};
    for (const Vec3& v : piece.polygon) lamp.end.box.extend(v);
    lamps.push_back(std::move(lamp));
  }
  return lamps;
}

// One lamp's light on the elements below a node; blockers still in question are on a stack.
class Walk {
 public:
  Walk(const Gather& gather, const ElementTree& tree, const ShaftCulling& culling,
       BandMatrix& direct)
      : gather_(gather), tree_(tree), culling_(culling), direct_(direct) {}

  void run(const ElementNode& node, const Lamp& lamp) {
    stack_ = culling_.blockers();
    descend(node, lamp, 0);
  }

 private:
  void descend(const ElementNode& node, const Lamp& lamp, std::size_t from) {
    const ShaftEnd end = node.end_of_shaft();
    if (end.is_behind(lamp.end.horizon, culling_.tolerance_m()) ||
        lamp.end.is_behind(end.horizon, culling_.tolerance_m()))
      return;
    const std::size_t to = stack_.size();
    if (culling_.keep_between(end, lamp.end, stack_, from, to)) {
      if (stack_.size() == to || node.is_leaf()) {
        for (std::uint32_t patch : tree_.patches_of(node))
          direct_.row(patch) +=
              gather_.mean_factor(patch, lamp.piece, {stack_.data() + to, stack_.size() - to},
                                  scratch_) *
              lamp.exitance;
      } else {
        descend(tree_.nodes[node.left], lamp, to);
        descend(tree_.nodes[node.right], lamp, to);
      }
    }
    stack_.resize(to);
  }

  const Gather& gather_;
  const ElementTree& tree_;
  const ShaftCulling& culling_;
  BandMatrix& direct_;
  std::vector<std::uint32_t> stack_;
  Gather::Scratch scratch_;
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
  const std::vector<Lamp> lamps = lamps_of(mesh, scene);
  std::vector<std::uint32_t> tasks;
  collect_tasks(tree, 0, std::max(kLeastElementsOfATask, tree.order.size() / kTasks), tasks);
  std::atomic<std::size_t> done{0};
  std::mutex progress_lock;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, tasks.size()), [&](const auto& range) {
    Walk walk(gather, tree, culling, direct);
    for (std::size_t t = range.begin(); t < range.end(); ++t)
      for (const Lamp& lamp : lamps) walk.run(tree.nodes[tasks[t]], lamp);
    const std::size_t count = done += range.end() - range.begin();
    if (!progress) return;
    const std::lock_guard guard(progress_lock);
    progress("direct light", static_cast<double>(count) / static_cast<double>(tasks.size()));
  });
  return direct;
}

}  // namespace truebox

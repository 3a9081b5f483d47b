// SPDX-License-Identifier: BSD-3-Clause
#include "transport/direct_light.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <map>
#include <mutex>
#include <span>

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

// From one lamp down the tree of elements; blockers still in question are on a stack.
class Walk {
 public:
  Walk(const ElementTree& tree, const ShaftCulling& culling) : tree_(tree), culling_(culling) {}

  // reach(node, blockers) for the first node on every way down from `index` that stops(node,
  // blockers); none for what cannot see the lamp.
  template <class Stops, class Reach>
  void run(std::uint32_t index, const LampEnd& lamp, std::span<const std::uint32_t> blockers,
           const Stops& stops, const Reach& reach) {
    stack_.assign(blockers.begin(), blockers.end());
    descend(index, lamp, 0, stops, reach);
  }

  // visit(element, lamp, blockers) for each element below `index` that may see the lamp.
  template <class Visit>
  void visit_elements(std::uint32_t index, const LampEnd& lamp,
                      std::span<const std::uint32_t> blockers, const Visit& visit) {
    run(
        index, lamp, blockers,
        [&](std::uint32_t node, auto between) {
          return between.empty() || tree_.nodes[node].is_leaf();
        },
        [&](std::uint32_t node, auto between) {
          for (std::uint32_t patch : tree_.patches_of(tree_.nodes[node]))
            visit(patch, lamp, between);
        });
  }

 private:
  template <class Stops, class Reach>
  void descend(std::uint32_t index, const LampEnd& lamp, std::size_t from, const Stops& stops,
               const Reach& reach) {
    const ElementNode& node = tree_.nodes[index];
    const ShaftEnd end = node.end_of_shaft();
    if (end.is_behind(lamp.end.horizon, culling_.tolerance_m()) ||
        lamp.end.is_behind(end.horizon, culling_.tolerance_m()))
      return;
    const std::size_t to = stack_.size();
    if (culling_.keep_between(end, lamp.end, stack_, from, to)) {
      const auto between = std::span<const std::uint32_t>(stack_).subspan(to);
      if (stops(index, between)) {
        reach(index, between);
      } else {
        descend(node.left, lamp, to, stops, reach);
        descend(node.right, lamp, to, stops, reach);
      }
    }
    stack_.resize(to);
  }

  const ElementTree& tree_;
  const ShaftCulling& culling_;
  std::vector<std::uint32_t> stack_;
};

constexpr std::size_t kTasks = 256, kLeastElementsOfATask = 64;

// A part of the tree, and the lamps that may reach it, in order, with what may stand between.
struct Task {
  struct Lamp {
    std::size_t index;
    std::vector<std::uint32_t> between;
  };
  std::uint32_t node;
  std::vector<Lamp> lamps;
};

// Every lamp walks down from the root once: most blockers of a large scene go in the first steps.
std::vector<Task> tasks_of(const ElementTree& tree, const ShaftCulling& culling,
                           const std::vector<LampEnd>& lamps) {
  const std::size_t most = std::max(kLeastElementsOfATask, tree.order.size() / kTasks);
  const auto is_task = [&](std::uint32_t node, auto) {
    return tree.nodes[node].is_leaf() || tree.nodes[node].end - tree.nodes[node].begin <= most;
  };
  std::vector<std::map<std::uint32_t, std::vector<std::uint32_t>>> reached(lamps.size());
  tbb::parallel_for(std::size_t{0}, lamps.size(), [&](std::size_t l) {
    Walk(tree, culling)
        .run(0, lamps[l], culling.blockers(), is_task, [&](std::uint32_t node, auto between) {
          reached[l].try_emplace(node, between.begin(), between.end());
        });
  });
  std::map<std::uint32_t, Task> tasks;
  for (std::size_t l = 0; l < lamps.size(); ++l)
    for (auto& [node, between] : reached[l]) {
      Task& task = tasks.try_emplace(node, Task{node, {}}).first->second;
      task.lamps.push_back({l, std::move(between)});
    }
  std::vector<Task> found;
  for (auto& [node, task] : tasks) found.push_back(std::move(task));
  return found;
}

}  // namespace

BandMatrix mean_direct(const PatchMesh& mesh, const Scene& scene, const Gather& gather,
                       const ElementTree& tree, const ShaftCulling& culling,
                       const Progress& progress) {
  BandMatrix direct = BandMatrix::Zero(static_cast<Eigen::Index>(mesh.size()),
                                       static_cast<Eigen::Index>(scene.bands.size()));
  const std::vector<LampEnd> lamps = ends_of_lamps(mesh, scene);
  const std::vector<Task> tasks = tasks_of(tree, culling, lamps);
  std::atomic<std::size_t> done{0};
  std::mutex progress_lock;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, tasks.size()), [&](const auto& range) {
    Gather::Scratch scratch;
    Walk walk(tree, culling);
    for (std::size_t t = range.begin(); t < range.end(); ++t)
      for (const Task::Lamp& lamp : tasks[t].lamps)
        walk.visit_elements(tasks[t].node, lamps[lamp.index], lamp.between,
                            [&](std::uint32_t patch, const LampEnd& end, auto between) {
                              direct.row(patch) +=
                                  gather.mean_factor(patch, end.piece, between, scratch) *
                                  end.exitance;
                            });
    const std::size_t count = done += range.end() - range.begin();
    if (!progress) return;
    const std::lock_guard guard(progress_lock);
    progress("direct light", static_cast<double>(count) / static_cast<double>(tasks.size()));
  });
  return direct;
}

LitElements::LitElements(const PatchMesh& mesh, const Scene& scene, const ElementTree& tree,
                         const ShaftCulling& culling)
    : lamps_(mesh.size()), partly_hidden_(mesh.size(), 0) {
  const auto add = [&](std::uint32_t patch, const LampEnd& lamp, auto between) {
    lamps_[patch].push_back(
        {lamp.piece, lamp.exitance.transpose(), {between.begin(), between.end()}});
    partly_hidden_[patch] |= !between.empty();
  };
  Walk walk(tree, culling);
  for (const LampEnd& lamp : ends_of_lamps(mesh, scene))
    walk.visit_elements(0, lamp, culling.blockers(), add);
}

}  // namespace truebox

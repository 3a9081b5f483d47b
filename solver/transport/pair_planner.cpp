// SPDX-License-Identifier: BSD-3-Clause
#include "transport/pair_planner.h"

#include <algorithm>
#include <numeric>

namespace truebox {
namespace {

constexpr std::uint32_t kNone = 0xffffffffu;

// Whether corners of the mesh lie on both sides of a plane.
bool stands_between(const Plane& plane, const PatchMesh& mesh, double tolerance_m) {
  bool front = false, behind = false;
  for (const Piece& piece : mesh.pieces)
    for (const Vec3& v : piece.polygon) {
      const double height = plane.distance_m(v);
      front |= height > tolerance_m;
      behind |= height < -tolerance_m;
      if (front && behind) return true;
    }
  return false;
}

}  // namespace

// A walk down two trees at once. Occluders that are still in question live on a stack.
class PairPlanner::Walk {
 public:
  Walk(const PairPlanner& planner, Memory& memory, const Visitor& visitor)
      : planner_(planner), memory_(memory), visitor_(visitor) {
    const std::size_t pairs = planner.nodes_.size() * planner.occluders_.size();
    memory.place.resize(pairs <= kMostPlaces ? pairs : 0);
  }

  void run(const Node& a, const Node& b) {
    stack_.resize(planner_.occluders_.size());
    std::iota(stack_.begin(), stack_.end(), 0u);
    descend(a, b, 0);
  }

 private:
  const Plane& plane_of(const Node& node) const { return planner_.mesh_.pieces[node.piece].plane; }

  bool any_in_front(const Node& node, const Plane& plane) const {
    return std::any_of(node.outline.begin(), node.outline.end(),
                       [&](const Vec3& v) { return plane.distance_m(v) > planner_.tolerance_m_; });
  }

  bool all_in_front(const Node& node, const Plane& plane) const {
    return std::all_of(node.outline.begin(), node.outline.end(), [&](const Vec3& v) {
      return plane.distance_m(v) >= -planner_.tolerance_m_;
    });
  }

  // Keeps the occluders that may stand in the shaft on top of the stack; false if one closes it.
  bool keep_occluders(const Node& a, const Node& b, std::size_t from, std::size_t to) {
    const Eigen::AlignedBox3d hull = a.box.merged(b.box);
    const std::uint32_t own_a = planner_.occluder_of_piece_[a.piece];
    const std::uint32_t own_b = planner_.occluder_of_piece_[b.piece];
    for (std::size_t k = from; k < to; ++k) {
      const std::uint32_t id = stack_[k];
      // A face of a convex solid looks away from it.
      if (id == own_a || id == own_b || !hull.intersects(planner_.occluders_[id].box)) continue;
      switch (shaft(a, b, id)) {
        case ShaftOcclusion::full: return false;
        case ShaftOcclusion::partial: stack_.push_back(id); break;
        case ShaftOcclusion::none: break;
      }
    }
    return true;
  }

  ShaftOcclusion shaft(const Node& a, const Node& b, std::uint32_t id) {
    const ConvexOccluder& solid = planner_.occluders_[id];
    if (memory_.place.empty())
      return shaft_occlusion(a.outline, plane_of(a), b.outline, plane_of(b), solid,
                             planner_.tolerance_m_);
    if (memory_.used + 2 > kMostEnds) forget();
    const std::uint32_t at_a = measured(a, id), at_b = measured(b, id);
    return shaft_occlusion(memory_.ends[at_a], memory_.ends[at_b], solid, planner_.tolerance_m_);
  }

  std::uint32_t measured(const Node& node, std::uint32_t id) {
    const auto index = static_cast<std::size_t>(&node - planner_.nodes_.data());
    std::uint32_t& place = memory_.place[index * planner_.occluders_.size() + id];
    if (place != 0) return place;
    place = static_cast<std::uint32_t>(++memory_.used);
    if (memory_.ends.size() <= place) memory_.ends.resize(2 * place);
    memory_.ends[place].measure(node.outline, plane_of(node), planner_.occluders_[id],
                                planner_.tolerance_m_);
    return place;
  }

  void forget() {
    std::fill(memory_.place.begin(), memory_.place.end(), 0u);
    memory_.used = 0;
  }

  void descend(const Node& a, const Node& b, std::size_t from) {
    if (!any_in_front(a, plane_of(b)) || !any_in_front(b, plane_of(a))) return;
    const std::size_t to = stack_.size();
    if (!keep_occluders(a, b, from, to)) {
      visitor_.hidden(static_cast<std::size_t>(a.end - a.begin) * (b.end - b.begin));
    } else if (stack_.size() == to) {
      visitor_.unoccluded(patches(a), patches(b),
                          all_in_front(a, plane_of(b)) && all_in_front(b, plane_of(a)));
    } else if (a.left == 0 && b.left == 0) {
      visitor_.partial(planner_.order_[a.begin], planner_.order_[b.begin],
                       {stack_.data() + to, stack_.size() - to});
    } else if (b.left == 0 || (a.left != 0 && a.size_m >= b.size_m)) {
      descend(planner_.nodes_[a.left], b, to);
      descend(planner_.nodes_[a.right], b, to);
    } else {
      descend(a, planner_.nodes_[b.left], to);
      descend(a, planner_.nodes_[b.right], to);
    }
    stack_.resize(to);
  }

  std::span<const std::uint32_t> patches(const Node& node) const {
    return {planner_.order_.data() + node.begin, node.end - node.begin};
  }

  static constexpr std::size_t kMostPlaces = std::size_t{1} << 22;  // 16 MiB
  static constexpr std::size_t kMostEnds = std::size_t{1} << 17;    // some 60 MiB

  const PairPlanner& planner_;
  Memory& memory_;
  const Visitor& visitor_;
  std::vector<std::uint32_t> stack_;
};

PairPlanner::PairPlanner(const PatchMesh& mesh, const Scene& scene,
                         const std::vector<PlanarPolygon>& patches, double tolerance_m,
                         bool occlusion)
    : mesh_(mesh), patches_(patches), tolerance_m_(tolerance_m) {
  occluder_of_piece_.assign(mesh.pieces.size(), kNone);
  if (occlusion) find_occluders(scene);
  order_.resize(mesh.size());
  std::iota(order_.begin(), order_.end(), 0u);
  leaf_.resize(mesh.size());
  nodes_.emplace_back();  // index 0 means "none"
  constexpr std::uint32_t kPatchesATask = 64;
  std::vector<std::vector<std::uint32_t>> groups(mesh.pieces.size());
  for (std::uint32_t p = 0; p < mesh.pieces.size(); ++p) {
    const Piece& piece = mesh.pieces[p];
    const Vec3 u = (piece.polygon[1] - piece.polygon[0]).normalized();
    root_.push_back(make_node(p, piece.first_patch, piece.first_patch + piece.patch_count, u,
                              piece.plane.normal.cross(u)));
    std::vector<std::uint32_t> open = {root_.back()};
    while (!open.empty()) {
      const Node& node = nodes_[open.back()];
      if (node.left == 0 || node.end - node.begin <= kPatchesATask) {
        groups[p].push_back(open.back());
        open.pop_back();
      } else {
        open.back() = node.left;
        open.push_back(node.right);
      }
    }
  }
  for (std::uint32_t p = 0; p < mesh.pieces.size(); ++p)
    for (std::uint32_t q = p + 1; q < mesh.pieces.size(); ++q)
      for (std::uint32_t group : groups[p]) tasks_.push_back({group, root_[q]});
}

void PairPlanner::find_occluders(const Scene& scene) {
  std::vector<std::uint32_t> piece_of_blocker;
  for (std::uint32_t p = 0; p < mesh_.pieces.size(); ++p) {
    const Piece& piece = mesh_.pieces[p];
    if (scene.surfaces[piece.surface].is_opening) continue;
    blockers_.push_back({piece.polygon, piece.plane});
    piece_of_blocker.push_back(p);
  }
  for (ConvexOccluder& solid : convex_occluders(blockers_, tolerance_m_)) {
    const Blocker& first = blockers_[solid.members[0]];
    if (solid.members.size() == 1 && !stands_between(first.plane, mesh_, tolerance_m_)) continue;
    for (std::uint32_t member : solid.members)
      occluder_of_piece_[piece_of_blocker[member]] = static_cast<std::uint32_t>(occluders_.size());
    // Boxes of flat pieces are thin: rounding must not pull them out of a shaft.
    solid.box.min().array() -= tolerance_m_;
    solid.box.max().array() += tolerance_m_;
    occluders_.push_back(std::move(solid));
  }
}

std::uint32_t PairPlanner::make_node(std::uint32_t piece, std::uint32_t begin, std::uint32_t end,
                                     const Vec3& u, const Vec3& v) {
  const auto index = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back();
  Node node;
  node.begin = begin;
  node.end = end;
  node.piece = piece;
  if (end - begin == 1) {
    node.outline = patches_[order_[begin]].vertices;
    leaf_[order_[begin]] = index;
  } else {
    const Vec3& origin = mesh_.pieces[piece].polygon[0];
    Eigen::AlignedBox2d flat;
    for (std::uint32_t k = begin; k < end; ++k)
      for (const Vec3& corner : patches_[order_[k]].vertices)
        flat.extend(Eigen::Vector2d(u.dot(corner - origin), v.dot(corner - origin)));
    const auto at = [&](double x, double y) -> Vec3 { return origin + x * u + y * v; };
    const auto &low = flat.min(), &high = flat.max();
    node.outline = {at(low.x(), low.y()), at(high.x(), low.y()), at(high.x(), high.y()),
                    at(low.x(), high.y())};
    const Vec3& along = flat.sizes().x() >= flat.sizes().y() ? u : v;
    const std::uint32_t middle = begin + (end - begin) / 2;
    std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                     [&](std::uint32_t i, std::uint32_t j) {
                       const double a = along.dot(patches_[i].centroid);
                       const double b = along.dot(patches_[j].centroid);
                       return a < b || (a == b && i < j);
                     });
    node.left = make_node(piece, begin, middle, u, v);
    node.right = make_node(piece, middle, end, u, v);
  }
  for (const Vec3& corner : node.outline) node.box.extend(corner);
  node.size_m = node.box.diagonal().norm();
  nodes_[index] = std::move(node);
  return index;
}

void PairPlanner::visit(std::size_t task, Memory& memory, const Visitor& visitor) const {
  Walk(*this, memory, visitor).run(nodes_[tasks_[task].a], nodes_[tasks_[task].b]);
}

void PairPlanner::visit_row(std::uint32_t patch, Memory& memory, const Visitor& visitor) const {
  Walk walk(*this, memory, visitor);
  const std::uint32_t piece = mesh_.patches[patch].piece;
  for (std::uint32_t p = 0; p < root_.size(); ++p)
    if (p != piece) walk.run(nodes_[leaf_[patch]], nodes_[root_[p]]);
}

}  // namespace truebox

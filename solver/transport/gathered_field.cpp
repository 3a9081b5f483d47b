// SPDX-License-Identifier: BSD-3-Clause
#include "transport/gathered_field.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>
#include <map>

#include "mesh/patch_topology.h"
#include "mesh/wachspress.h"
#include "transport/direct_light.h"
#include "transport/element_tree.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr std::uint32_t kNone = ~0u;
constexpr int kLayers = 5;               // the thinnest cell is 1/32 of an element wide
constexpr double kInside = 0.1;          // of the way to the centroid: corners on a rim
constexpr std::uint32_t kReceivers = 4;  // elements whose corners share their blockers
constexpr std::uint32_t kSources = 4;    // elements of a partly hidden group
// Length : distance above which a source is split: lit evenly, or with a shadow's edge across it.
constexpr double kNearField = 0.7, kNearPenumbra = 0.35;
constexpr int kMostSweeps = 60;
constexpr double kConverged = 1e-6;  // of the largest correction

Eigen::Map<const Eigen::RowVectorXd> reflectance_of(const Scene& scene, const Piece& piece) {
  const auto& rho = scene.material_of(scene.surfaces[piece.surface]).reflectance.values;
  return {rho.data(), static_cast<Index>(rho.size())};
}

void collect_tasks(const ElementTree& tree, std::uint32_t index,
                   std::vector<std::uint32_t>& tasks) {
  const ElementNode& node = tree.nodes[index];
  if (node.is_leaf() || (node.one_normal && node.end - node.begin <= kReceivers)) {
    tasks.push_back(index);
    return;
  }
  collect_tasks(tree, node.left, tasks);
  collect_tasks(tree, node.right, tasks);
}

}  // namespace

// What the corners of a group of elements receive, and from which other corners.
class GatheredField::Collector {
 public:
  Collector(const GatheredField& field, const ElementTree& tree, const ShaftCulling& culling,
            const LitElements& lit, const std::vector<double>& diameter_m, BandMatrix& sum,
            std::vector<std::vector<Weight>>& weights)
      : field_(field),
        sources_(field.sources_),
        tree_(tree),
        culling_(culling),
        lit_(lit),
        diameter_m_(diameter_m),
        sum_(sum),
        weights_(weights),
        share_(field.nodes_.size(), 0.0),
        value_(sum.cols()) {}

  void run(const ElementNode& receivers, const std::vector<std::uint32_t>& nodes) {
    if (nodes.empty()) return;
    nodes_ = &nodes;
    end_ = receivers.end_of_shaft();
    jobs_.clear();
    blockers_.clear();
    stack_ = culling_.blockers();
    descend(tree_.nodes[0], 0);
    for (std::uint32_t node : nodes) gather(node);
  }

 private:
  struct Job {
    const ElementNode* sources;
    std::size_t first_blocker, blocker_count;
  };

  void descend(const ElementNode& node, std::size_t from) {
    const ShaftEnd end = node.end_of_shaft();
    if (end.is_behind(end_.horizon, culling_.tolerance_m()) ||
        end_.is_behind(end.horizon, culling_.tolerance_m()))
      return;
    const std::size_t to = stack_.size();
    if (culling_.keep_between(end_, end, stack_, from, to)) {
      if (node.is_leaf() ||
          (node.one_normal && (stack_.size() == to || node.end - node.begin <= kSources))) {
        jobs_.push_back({&node, blockers_.size(), stack_.size() - to});
        blockers_.insert(blockers_.end(), stack_.begin() + static_cast<std::ptrdiff_t>(to),
                         stack_.end());
      } else {
        descend(tree_.nodes[node.left], to);
        descend(tree_.nodes[node.right], to);
      }
    }
    stack_.resize(to);
  }

  void gather(std::uint32_t index) {
    const Node& node = field_.nodes_[index];
    if (node.is_hanging) return;
    const Vec3& normal = sources_.mesh.plane_of(sources_.mesh.patches[node.patch]).normal;
    auto sum = sum_.row(index);
    for (const Job& job : jobs_) {
      const std::span<const std::uint32_t> between{blockers_.data() + job.first_blocker,
                                                   job.blocker_count};
      for (std::uint32_t j : tree_.patches_of(*job.sources)) {
        const Patch& patch = sources_.mesh.patches[j];
        sources_.mesh.polygon_of(patch, polygon_);
        const double near_field = lit_.is_partly_hidden(j) ? kNearPenumbra : kNearField;
        if (diameter_m_[j] > near_field * (patch.centroid - node.point).norm()) {
          const auto add = [&](double factor, const Vec3& at, int) {
            sum += factor * near_source(j, at, factor);
          };
          sources_.gather.visit_parts(node.point, normal, polygon_, patch.piece, near_field,
                                      between, add, scratch_);
          continue;
        }
        const double factor = sources_.gather.visible_factor(node.point, normal, polygon_,
                                                             patch.piece, between, scratch_);
        if (factor > 0.0) sum += factor * sources_.reflected.row(j);
      }
    }
    for (std::uint32_t touched : touched_) {
      weights_[index].push_back({touched, share_[touched]});
      share_[touched] = 0.0;
    }
    touched_.clear();
  }

  // Reflected radiosity of a point without its correction, whose share is noted.
  Eigen::RowVectorXd near_source(std::uint32_t patch, const Vec3& at, double factor) {
    const PatchMesh& mesh = sources_.mesh;
    const Piece& piece = mesh.pieces[mesh.patches[patch].piece];
    sources_.smooth.evaluate(patch, at, value_);
    for (const LitElements::Lamp& lamp : lit_.lamps_of(patch))
      value_ += lamp.exitance * sources_.gather.visible_factor(
                                    at, piece.plane.normal, mesh.pieces[lamp.piece].polygon,
                                    lamp.piece, lamp.between, source_scratch_);
    const PatchMesh& cells = field_.cells_.mesh;
    const Patch& cell = cells.patches[field_.find_cell(patch, at)];
    if (field_.node_of_[cell.first_corner] != kNone) {
      WachspressWeights lambda;
      const std::size_t count = wachspress_weights(cells, cell, at, lambda);
      for (std::size_t k = 0; k < count; ++k) {
        const std::uint32_t node = field_.node_of_[cell.first_corner + k];
        if (share_[node] == 0.0) touched_.push_back(node);
        share_[node] += factor * lambda[k] + std::numeric_limits<double>::min();
      }
    }
    return value_.transpose().cwiseProduct(reflectance_of(sources_.scene, piece));
  }

  const GatheredField& field_;
  const FieldSources& sources_;
  const ElementTree& tree_;
  const ShaftCulling& culling_;
  const LitElements& lit_;
  const std::vector<double>& diameter_m_;
  BandMatrix& sum_;
  std::vector<std::vector<Weight>>& weights_;
  const std::vector<std::uint32_t>* nodes_ = nullptr;
  ShaftEnd end_;
  std::vector<Job> jobs_;
  std::vector<std::uint32_t> blockers_, stack_, touched_;
  std::vector<double> share_;
  Polygon polygon_;
  Eigen::VectorXd value_;
  Gather::Scratch scratch_, source_scratch_;
};

GatheredField::GatheredField(const FieldSources& sources)
    : sources_(sources), cells_(edge_layers(sources.mesh, sources.scene, sources.usable, kLayers)) {
  place_nodes();
  std::vector<std::vector<Weight>> weights(nodes_.size());
  gather_nodes(weights);
  solve(weights);
}

void GatheredField::place_nodes() {
  const PatchMesh& mesh = cells_.mesh;
  std::vector<char> usable(mesh.size());
  for (std::size_t c = 0; c < usable.size(); ++c) {
    const Piece& piece = mesh.pieces[mesh.patches[c].piece];
    usable[c] =
        sources_.usable[cells_.parent[c]] && !sources_.scene.surfaces[piece.surface].is_opening;
  }
  const PatchTopology topology(mesh);
  node_of_.assign(mesh.corners.size(), kNone);
  // A corner is one place to all cells that can be reached around it, not across contact lines.
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> known;
  for (std::uint32_t c = 0; c < mesh.size(); ++c) {
    if (!usable[c]) continue;
    const Patch& cell = mesh.patches[c];
    for (std::uint32_t k = 0; k < cell.corner_count; ++k) {
      const std::uint32_t vertex = mesh.corners[cell.first_corner + k];
      const std::uint32_t first = topology.reachable(usable, c, vertex, 1).front();
      const auto [it, is_new] =
          known.try_emplace({vertex, first}, static_cast<std::uint32_t>(nodes_.size()));
      node_of_[cell.first_corner + k] = it->second;
      if (is_new) nodes_.push_back({mesh.vertices[vertex], cells_.parent[c]});
      const std::uint32_t before = (k + cell.corner_count - 1) % cell.corner_count;
      Node& node = nodes_[it->second];
      const bool is_rim = topology.across(c, k).empty() || topology.across(c, before).empty();
      if (is_rim && node.point == mesh.vertices[vertex]) {
        node.point += kInside * (cell.centroid - node.point);
        node.patch = cells_.parent[c];
      }
    }
  }
  for (const PatchTopology::Constraint& c : topology.constraints(usable)) {
    hanging_.push_back({node_of_[c.corner], node_of_[c.from], node_of_[c.to], c.share});
    nodes_[node_of_[c.corner]].is_hanging = true;
  }
}

void GatheredField::gather_nodes(std::vector<std::vector<Weight>>& weights) {
  const PatchMesh& mesh = sources_.mesh;
  const Index bands = sources_.reflected.cols();
  correction_ = BandMatrix::Zero(static_cast<Index>(nodes_.size()), bands);
  if (nodes_.empty()) return;
  std::vector<std::vector<std::uint32_t>> nodes_of_patch(mesh.size());
  for (std::uint32_t n = 0; n < nodes_.size(); ++n) nodes_of_patch[nodes_[n].patch].push_back(n);
  std::vector<std::uint32_t> bright;
  std::vector<double> diameters_m(mesh.size());
  Polygon polygon;
  for (std::uint32_t j = 0; j < mesh.size(); ++j) {
    mesh.polygon_of(mesh.patches[j], polygon);
    diameters_m[j] = diameter_m(polygon);
    if (reflectance_of(sources_.scene, mesh.pieces[mesh.patches[j].piece]).maxCoeff() > 0.0)
      bright.push_back(j);
  }
  if (bright.empty()) return;
  const ElementTree receivers = element_tree(mesh), sources = element_tree(mesh, bright);
  const ShaftCulling culling(mesh, sources_.scene, sources_.occlusion);
  const LitElements lit(mesh, sources_.scene, sources, culling);
  std::vector<std::uint32_t> tasks;
  collect_tasks(receivers, 0, tasks);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, tasks.size()), [&](const auto& range) {
    Collector collector(*this, sources, culling, lit, diameters_m, correction_, weights);
    std::vector<std::uint32_t> nodes;
    for (std::size_t t = range.begin(); t < range.end(); ++t) {
      const ElementNode& group = receivers.nodes[tasks[t]];
      nodes.clear();
      for (std::uint32_t patch : receivers.patches_of(group))
        nodes.insert(nodes.end(), nodes_of_patch[patch].begin(), nodes_of_patch[patch].end());
      collector.run(group, nodes);
    }
  });
  Eigen::VectorXd smooth(bands);
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    sources_.smooth.evaluate(nodes_[n].patch, nodes_[n].point, smooth);
    correction_.row(static_cast<Index>(n)) -= smooth.transpose();
  }
}

// Gauss-Seidel: corners of one wall take what those of the next have just become.
void GatheredField::solve(const std::vector<std::vector<Weight>>& weights) {
  const BandMatrix own = correction_;
  tie_hanging();
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    double change = 0.0;
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
      if (weights[n].empty()) continue;
      const auto row = static_cast<Index>(n);
      Eigen::RowVectorXd next = own.row(row);
      for (const Weight& w : weights[n]) {
        const Piece& piece =
            sources_.mesh.pieces[sources_.mesh.patches[nodes_[w.node].patch].piece];
        next += w.factor * reflectance_of(sources_.scene, piece)
                               .cwiseProduct(correction_.row(static_cast<Index>(w.node)));
      }
      change = std::max(change, (next - correction_.row(row)).cwiseAbs().maxCoeff());
      correction_.row(row) = next;
    }
    tie_hanging();
    if (change <= kConverged * correction_.cwiseAbs().maxCoeff()) return;
  }
}

// A corner that hangs in the edge of a larger cell takes that cell's value: no cracks.
void GatheredField::tie_hanging() {
  for (const Hanging& h : hanging_)
    correction_.row(h.node) =
        (1.0 - h.share) * correction_.row(h.from) + h.share * correction_.row(h.to);
}

std::uint32_t GatheredField::find_cell(std::uint32_t patch, const Vec3& point) const {
  const PatchMesh& mesh = cells_.mesh;
  std::uint32_t nearest = cells_.first_cell[patch];
  const std::uint32_t end = cells_.first_cell[patch + 1];
  if (end - nearest == 1) return nearest;
  const Vec3& normal = mesh.plane_of(mesh.patches[nearest]).normal;
  double best_m2 = std::numeric_limits<double>::infinity();
  for (std::uint32_t c = nearest; c < end; ++c) {
    const auto corners = mesh.corners_of(mesh.patches[c]);
    double outside_m2 = 0.0;
    for (std::size_t k = 0; k < corners.size() && outside_m2 < best_m2; ++k) {
      const Vec3& a = mesh.vertices[corners[k]];
      const Vec3 along = mesh.vertices[corners[(k + 1) % corners.size()]] - a;
      const double side = normal.cross(along).dot(point - a);
      if (side < 0.0) outside_m2 = std::max(outside_m2, side * side / along.squaredNorm());
    }
    if (outside_m2 == 0.0) return c;
    if (outside_m2 < best_m2) best_m2 = outside_m2, nearest = c;
  }
  return nearest;
}

GatheredField GatheredField::extrapolated(const GatheredField& coarse, double share) const {
  GatheredField moved = *this;
  const SmoothField& places = coarse.sources_.smooth;
  Eigen::VectorXd here(correction_.cols()), there(correction_.cols());
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    const Node& node = nodes_[n];
    const auto row = static_cast<Index>(n);
    const std::uint32_t piece = sources_.mesh.patches[node.patch].piece;
    const std::uint32_t cell = coarse.find_cell(places.find_patch(piece, node.point), node.point);
    coarse.evaluate(cell, node.point, there);
    sources_.smooth.evaluate(node.patch, node.point, here);
    moved.correction_.row(row) +=
        share * (here + correction_.row(row).transpose() - there).transpose();
  }
  moved.tie_hanging();
  return moved;
}

void GatheredField::evaluate(std::uint32_t cell_index, const Vec3& point,
                             Eigen::Ref<Eigen::VectorXd> values) const {
  sources_.smooth.evaluate(cells_.parent[cell_index], point, values);
  const Patch& cell = cells_.mesh.patches[cell_index];
  if (node_of_[cell.first_corner] == kNone) return;
  WachspressWeights lambda;
  const std::size_t count = wachspress_weights(cells_.mesh, cell, point, lambda);
  for (std::size_t k = 0; k < count; ++k)
    values += lambda[k] * correction_.row(node_of_[cell.first_corner + k]).transpose();
  values = values.cwiseMax(0.0);
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "transport/gathered_field.h"

#include <tbb/blocked_range.h>
#include <tbb/concurrent_unordered_map.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>

#include "transport/direct_light.h"
#include "transport/element_tree.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr int kLayers = 5;               // the thinnest cell is 1/32 of an element wide
constexpr std::uint32_t kReceivers = 4;  // elements whose points share their blockers
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

// What points need of a grid, whichever points they are.
struct GatheredField::Surroundings {
  explicit Surroundings(const FieldSources& sources, std::vector<std::uint32_t> bright)
      : receivers(element_tree(sources.mesh)),
        tree(element_tree(sources.mesh, std::move(bright))),
        culling(sources.mesh, sources.scene, sources.occlusion),
        lit(sources.mesh, sources.scene, tree, culling),
        diameters_m(sources.mesh.size()) {
    collect_tasks(receivers, 0, tasks);
    sent.max_load_factor(1.0f);
    Polygon polygon;
    for (std::uint32_t j = 0; j < diameters_m.size(); ++j) {
      sources.mesh.polygon_of(sources.mesh.patches[j], polygon);
      diameters_m[j] = diameter_m(polygon);
    }
  }
  ElementTree receivers, tree;
  ShaftCulling culling;
  LitElements lit;
  std::vector<double> diameters_m;
  std::vector<std::uint32_t> tasks;  // nodes of `receivers`

  struct PartOf {
    std::uint32_t patch;
    std::uint64_t path;
    bool operator==(const PartOf&) const = default;
  };
  struct PartHash {
    std::size_t operator()(const PartOf& part) const {
      return (part.path * 0x9e3779b97f4a7c15u + part.patch) * 0xbf58476d1ce4e5b9u;
    }
  };
  // What the centre of a part of an element reflects: light, and shares of corrections not yet
  // found.
  struct Sent {
    Eigen::RowVectorXd light;
    std::vector<CellField::Share> corrections;
  };
  mutable tbb::concurrent_unordered_map<PartOf, Sent, PartHash> sent;
  bool is_solved = false;
};

// What the points of a group of elements receive, and from which corners.
class GatheredField::Collector {
 public:
  Collector(const GatheredField& field, const std::vector<GatherPlace>& places, BandMatrix& sum,
            std::vector<Weights>& weights)
      : field_(field),
        sources_(field.sources_),
        around_(*field.around_),
        places_(places),
        sum_(sum),
        weights_(weights),
        share_(field.correction_.nodes().size(), 0.0),
        value_(sum.cols()) {}

  void run(const ElementNode& receivers, const std::vector<std::uint32_t>& places) {
    if (places.empty()) return;
    end_ = receivers.end_of_shaft();
    jobs_.clear();
    blockers_.clear();
    stack_ = around_.culling.blockers();
    descend(around_.tree.nodes[0], 0);
    for (std::uint32_t place : places) gather(place);
  }

 private:
  struct Job {
    const ElementNode* sources;
    std::size_t first_blocker, blocker_count;
  };

  void descend(const ElementNode& node, std::size_t from) {
    const ShaftEnd end = node.end_of_shaft();
    const ShaftCulling& culling = around_.culling;
    if (end.is_behind(end_.horizon, culling.tolerance_m()) ||
        end_.is_behind(end.horizon, culling.tolerance_m()))
      return;
    const std::size_t to = stack_.size();
    if (culling.keep_between(end_, end, stack_, from, to)) {
      if (node.is_leaf() ||
          (node.one_normal && (stack_.size() == to || node.end - node.begin <= kSources))) {
        jobs_.push_back({&node, blockers_.size(), stack_.size() - to});
        blockers_.insert(blockers_.end(), stack_.begin() + static_cast<std::ptrdiff_t>(to),
                         stack_.end());
      } else {
        descend(around_.tree.nodes[node.left], to);
        descend(around_.tree.nodes[node.right], to);
      }
    }
    stack_.resize(to);
  }

  void gather(std::uint32_t index) {
    const GatherPlace& place = places_[index];
    const Vec3& normal = sources_.mesh.plane_of(sources_.mesh.patches[place.patch]).normal;
    auto sum = sum_.row(index);
    for (const Job& job : jobs_) {
      const std::span<const std::uint32_t> between{blockers_.data() + job.first_blocker,
                                                   job.blocker_count};
      for (std::uint32_t j : around_.tree.patches_of(*job.sources)) {
        const Patch& patch = sources_.mesh.patches[j];
        sources_.mesh.polygon_of(patch, polygon_);
        const double near_field = around_.lit.is_partly_hidden(j) ? kNearPenumbra : kNearField;
        if (around_.diameters_m[j] > near_field * (patch.centroid - place.point).norm()) {
          const auto add = [&](double factor, const Gather::Part& part) {
            add_part(j, part, factor, sum);
          };
          sources_.gather.visit_parts(place.point, normal, polygon_, patch.piece, near_field,
                                      between, add, scratch_);
          continue;
        }
        const double factor = sources_.gather.visible_factor(place.point, normal, polygon_,
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

  // What a part sends, found once for all who look at it.
  void add_part(std::uint32_t patch, const Gather::Part& part, double factor,
                BandMatrix::RowXpr sum) {
    if (part.path == 0) return add(sent_from(patch, part.centre), factor, sum);
    const Surroundings::PartOf key{patch, part.path};
    auto known = around_.sent.find(key);
    if (known == around_.sent.end())
      known = around_.sent.emplace(key, sent_from(patch, part.centre)).first;
    add(known->second, factor, sum);
  }

  void add(const Surroundings::Sent& sent, double factor, BandMatrix::RowXpr sum) {
    sum += factor * sent.light;
    for (const CellField::Share& of : sent.corrections) {
      if (share_[of.node] == 0.0) touched_.push_back(of.node);
      share_[of.node] += factor * of.factor + std::numeric_limits<double>::min();
    }
  }

  // Reflected radiosity of a point: from the lamps, exact, and from the field; while that is still
  // sought, its correction is only noted.
  Surroundings::Sent sent_from(std::uint32_t patch, const Vec3& at) {
    const PatchMesh& mesh = sources_.mesh;
    const Piece& piece = mesh.pieces[mesh.patches[patch].piece];
    sources_.smooth.evaluate(patch, at, value_);
    for (const LitElements::Lamp& lamp : around_.lit.lamps_of(patch))
      value_ += lamp.exitance * sources_.gather.visible_factor(
                                    at, piece.plane.normal, mesh.pieces[lamp.piece].polygon,
                                    lamp.piece, lamp.between, source_scratch_);
    Surroundings::Sent sent;
    const CellField& correction = field_.correction_;
    const CellField::Shares shares = correction.shares_at(correction.find_cell(patch, at), at);
    if (!around_.is_solved)
      sent.corrections.assign(shares.begin(), shares.end());
    else
      for (const CellField::Share& of : shares)
        value_ += of.factor * correction.values.row(of.node).transpose();
    sent.light = value_.transpose().cwiseProduct(reflectance_of(sources_.scene, piece));
    return sent;
  }

  const GatheredField& field_;
  const FieldSources& sources_;
  const Surroundings& around_;
  const std::vector<GatherPlace>& places_;
  BandMatrix& sum_;
  std::vector<Weights>& weights_;
  ShaftEnd end_;
  std::vector<Job> jobs_;
  std::vector<std::uint32_t> blockers_, stack_, touched_;
  std::vector<double> share_;
  Polygon polygon_;
  Eigen::VectorXd value_;
  Gather::Scratch scratch_, source_scratch_;
};

GatheredField::GatheredField(const FieldSources& sources)
    : sources_(sources),
      correction_(edge_layers(sources.mesh, sources.scene, sources.usable, kLayers), sources.scene,
                  sources.usable, sources.reflected.cols()) {
  std::vector<std::uint32_t> bright;
  for (std::uint32_t j = 0; j < sources.mesh.size(); ++j)
    if (reflectance_of(sources.scene, sources.mesh.pieces[sources.mesh.patches[j].piece])
            .maxCoeff() > 0.0)
      bright.push_back(j);
  if (bright.empty()) return;
  around_ = std::make_unique<Surroundings>(sources_, std::move(bright));
  solve();
  around_->sent.clear();
  around_->is_solved = true;
}

GatheredField::~GatheredField() = default;

// Of the places whose elements receive light; rows of others stay 0.
BandMatrix GatheredField::collect(const std::vector<GatherPlace>& places,
                                  std::vector<Weights>& weights) const {
  BandMatrix sum = BandMatrix::Zero(static_cast<Index>(places.size()), sources_.reflected.cols());
  weights.assign(places.size(), {});
  if (!around_ || places.empty()) return sum;
  std::vector<std::vector<std::uint32_t>> places_of(sources_.mesh.size());
  for (std::uint32_t n = 0; n < places.size(); ++n) places_of[places[n].patch].push_back(n);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, around_->tasks.size()),
                    [&](const auto& range) {
                      Collector collector(*this, places, sum, weights);
                      std::vector<std::uint32_t> here;
                      for (std::size_t t = range.begin(); t < range.end(); ++t) {
                        const ElementNode& group = around_->receivers.nodes[around_->tasks[t]];
                        here.clear();
                        for (std::uint32_t patch : around_->receivers.patches_of(group))
                          here.insert(here.end(), places_of[patch].begin(), places_of[patch].end());
                        collector.run(group, here);
                      }
                    });
  return sum;
}

Eigen::RowVectorXd GatheredField::sent_by(const Weights& weights) const {
  Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(correction_.values.cols());
  for (const CellField::Share& w : weights) {
    const Piece& piece =
        sources_.mesh.pieces[sources_.mesh.patches[correction_.nodes()[w.node].patch].piece];
    sum += w.factor *
           reflectance_of(sources_.scene, piece).cwiseProduct(correction_.values.row(w.node));
  }
  return sum;
}

BandMatrix GatheredField::gathered_at(const std::vector<GatherPlace>& places) const {
  std::vector<Weights> none;
  return collect(places, none);
}

// Gauss-Seidel: corners of one wall take what those of the next have just become.
void GatheredField::solve() {
  const std::vector<CellField::Node>& nodes = correction_.nodes();
  std::vector<GatherPlace> places;
  std::vector<Index> row_of;
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    if (nodes[n].is_hanging) continue;
    places.push_back({nodes[n].point, nodes[n].patch});
    row_of.push_back(static_cast<Index>(n));
  }
  std::vector<Weights> weights;
  BandMatrix own = collect(places, weights);
  Eigen::VectorXd smooth(own.cols());
  for (std::size_t k = 0; k < places.size(); ++k) {
    sources_.smooth.evaluate(places[k].patch, places[k].point, smooth);
    own.row(static_cast<Index>(k)) -= smooth.transpose();
    correction_.values.row(row_of[k]) = own.row(static_cast<Index>(k));
  }
  correction_.tie_hanging(correction_.values);
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    double change = 0.0;
    for (std::size_t k = 0; k < places.size(); ++k) {
      if (weights[k].empty()) continue;
      const Eigen::RowVectorXd next = own.row(static_cast<Index>(k)) + sent_by(weights[k]);
      auto now = correction_.values.row(row_of[k]);
      change = std::max(change, (next - now).cwiseAbs().maxCoeff());
      now = next;
    }
    correction_.tie_hanging(correction_.values);
    if (change <= kConverged * correction_.values.cwiseAbs().maxCoeff()) return;
  }
}

void GatheredField::evaluate(std::uint32_t cell, const Vec3& point,
                             Eigen::Ref<Eigen::VectorXd> values) const {
  sources_.smooth.evaluate(cells().parent[cell], point, values);
  correction_.add_to(cell, point, values);
  values = values.cwiseMax(0.0);
}

}  // namespace truebox

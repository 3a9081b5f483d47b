// SPDX-License-Identifier: BSD-3-Clause
#include "transport/refined_field.h"

#include <algorithm>
#include <map>
#include <tuple>

#include "mesh/cell_tree.h"
#include "transport/grid_difference.h"

namespace truebox {
namespace {

using Eigen::Index;
using Eigen::RowVectorXd;

// A correction that varies less than this, relative to `within`, is interpolated well enough: in
// a cell across which it is no more than bent, the middle is off by a quarter of the variation.
constexpr double kTested = 2.0;
constexpr double kUntestedShare = 0.25;
constexpr double kLong = 2.0;  // length : width of a cell that is cut across

// The parts of a cell cut once: of long quads two, of other quads and triangles four.
std::vector<Polygon> cut(const Polygon& p) {
  if (p.size() > 4) {
    std::vector<Polygon> parts;
    for (std::size_t i = 2; i < p.size(); ++i) parts.push_back({p[0], p[i - 1], p[i]});
    return parts;
  }
  if (p.size() == 4) {
    const double along = (p[0] + p[3] - p[1] - p[2]).norm();
    const double across = (p[0] + p[1] - p[2] - p[3]).norm();
    if (std::max(along, across) >= kLong * std::min(along, across)) {
      const auto [first, second] = CellTree::halves(p, along > across ? 0 : 1);
      return {first, second};
    }
  }
  return CellTree::quarters(p);
}

}  // namespace

class FieldRefinement {
 public:
  FieldRefinement(const std::array<const GatheredField*, 3>& grids,
                  const RefinedFieldOptions& options, RefinedField& result)
      : grids_(grids),
        options_(options),
        finest_(grids[0]->sources()),
        bands_(finest_.reflected.cols()),
        result_(result),
        smooth_at_(bands_),
        direct_at_(bands_) {}

  void run() {
    start();
    for (int round = 0;; ++round) {
      lay_out();
      gather_nodes();
      if (!test_cells(round < options_.deepest)) break;
    }
    bound_cells();
  }

 private:
  // What is known of a place: irradiance on the finest grid, light from the lamps, the correction
  // to the smooth field after extrapolation, and the bound.
  struct Known {
    RowVectorXd finest, direct, correction, bound;
  };
  struct Cell {
    Polygon polygon;
    std::optional<RowVectorXd> off;  // what interpolation was found to be off by in its middle
  };
  using Key = std::tuple<std::uint32_t, double, double, double>;

  static Key key_of(const GatherPlace& place) {
    return {place.patch, place.point[0], place.point[1], place.point[2]};
  }

  void start() {
    const LayeredMesh& layers = grids_[0]->cells();
    cells_of_.resize(finest_.mesh.size());
    for (std::uint32_t c = 0; c < layers.mesh.size(); ++c) {
      Cell& cell = cells_of_[layers.parent[c]].emplace_back();
      layers.mesh.polygon_of(layers.mesh.patches[c], cell.polygon);
    }
  }

  // The cells as they are now, and the nodes between them.
  void lay_out() {
    std::vector<std::vector<Polygon>> polygons(cells_of_.size());
    for (std::size_t i = 0; i < polygons.size(); ++i)
      for (const Cell& cell : cells_of_[i]) polygons[i].push_back(cell.polygon);
    result_.correction_ =
        CellField(layered_mesh(finest_.mesh, polygons), finest_.scene, finest_.usable, bands_);
  }

  std::vector<GatherPlace> on_grid(std::size_t grid, std::vector<GatherPlace> places) const {
    const SmoothField& field = grids_[grid]->sources().smooth;
    for (GatherPlace& place : places)
      place.patch = field.find_patch(finest_.mesh.patches[place.patch].piece, place.point);
    return places;
  }

  RowVectorXd direct_at(const GatherPlace& place) {
    direct_at_.setZero();
    finest_.gather.add_direct(place.point,
                              finest_.mesh.plane_of(finest_.mesh.patches[place.patch]).normal,
                              direct_at_, scratch_);
    return direct_at_.transpose();
  }
  RowVectorXd smooth_at(const GatherPlace& place) {
    finest_.smooth.evaluate(place.patch, place.point, smooth_at_);
    return smooth_at_.transpose();
  }

  void gather_nodes() {
    CellField& field = result_.correction_;
    std::vector<GatherPlace> unknown;
    for (const CellField::Node& node : field.nodes())
      if (const GatherPlace place{node.point, node.patch};
          !node.is_hanging && !known_.contains(key_of(place)))
        unknown.push_back(place);
    std::array<BandMatrix, 3> at;
    for (std::size_t k = 0; k < at.size(); ++k)
      at[k] = grids_[k]->gathered_at(k == 0 ? unknown : on_grid(k, unknown));
    result_.gathered_count_ += unknown.size();
    for (std::size_t n = 0; n < unknown.size(); ++n) {
      const auto row = static_cast<Index>(n);
      const RowVectorXd change = at[0].row(row) - at[1].row(row);
      Known& known = known_[key_of(unknown[n])];
      known.finest = at[0].row(row);
      known.direct = direct_at(unknown[n]);
      known.correction =
          (known.finest + options_.share * change).cwiseMax(0.0) - smooth_at(unknown[n]);
      known.bound = options_.bound_factor.transpose()
                        .cwiseProduct(change.cwiseAbs())
                        .cwiseMax(guarded_difference(at[0].row(row), at[1].row(row), at[2].row(row),
                                                     kGatheredOrder)) +
                    options_.share * change.cwiseAbs();
    }
    finest_of_nodes_ = bound_of_nodes_ = field.values;
    least_of_nodes_ = field.values;
    for (std::size_t n = 0; n < field.nodes().size(); ++n) {
      const CellField::Node& node = field.nodes()[n];
      if (node.is_hanging) continue;
      const auto row = static_cast<Index>(n);
      const GatherPlace place{node.point, node.patch};
      const Known& known = known_.at(key_of(place));
      field.values.row(row) = known.correction;
      finest_of_nodes_.row(row) = known.finest - smooth_at(place);
      bound_of_nodes_.row(row) = known.bound;
      least_of_nodes_.row(row) = known.finest + known.direct;
    }
    for (BandMatrix* of_nodes :
         {&field.values, &finest_of_nodes_, &bound_of_nodes_, &least_of_nodes_})
      field.tie_hanging(*of_nodes);
  }

  // Variation of the finest grid's correction in a cell, and the least irradiance at its corners.
  void range_in(std::uint32_t index, RowVectorXd& variation, RowVectorXd& least) const {
    const CellField& field = result_.correction_;
    const Patch& cell = field.cells().mesh.patches[index];
    const auto first = static_cast<Index>(field.node_of(cell, 0));
    RowVectorXd low = finest_of_nodes_.row(first), high = low;
    least = least_of_nodes_.row(first);
    for (std::size_t k = 1; k < cell.corner_count; ++k) {
      const auto node = static_cast<Index>(field.node_of(cell, k));
      low = low.cwiseMin(finest_of_nodes_.row(node));
      high = high.cwiseMax(finest_of_nodes_.row(node));
      least = least.cwiseMin(least_of_nodes_.row(node));
    }
    variation = high - low;
  }

  static bool exceeds(const RowVectorXd& value, double share, const RowVectorXd& whole) {
    return (value - share * whole).maxCoeff() > 0.0;
  }

  // Gathers in the middle of cells that may want it; whether any was cut.
  bool test_cells(bool may_cut) {
    const CellField& field = result_.correction_;
    const LayeredMesh& cells = field.cells();
    std::vector<GatherPlace> middles;
    std::vector<std::uint32_t> tested;
    variation_.resize(static_cast<Index>(cells.mesh.size()), bands_);
    RowVectorXd variation, least;
    for (std::uint32_t c = 0; c < cells.mesh.size(); ++c) {
      const Patch& patch = cells.mesh.patches[c];
      if (field.node_of(patch, 0) == CellField::kNone) continue;
      range_in(c, variation, least);
      variation_.row(c) = variation;
      if (cell(c).off || !exceeds(variation, kTested * options_.within, least)) continue;
      middles.push_back({patch.centroid, cells.parent[c]});
      tested.push_back(c);
    }
    const BandMatrix gathered = grids_[0]->gathered_at(middles);
    result_.gathered_count_ += middles.size();
    std::vector<char> is_cut(cells.mesh.size(), 0);
    bool any = false;
    for (std::size_t n = 0; n < tested.size(); ++n) {
      const std::uint32_t c = tested[n];
      RowVectorXd interpolated = smooth_at(middles[n]);
      for (const CellField::Share& of : field.shares_at(c, middles[n].point))
        interpolated += of.factor * finest_of_nodes_.row(of.node);
      const auto here = gathered.row(static_cast<Index>(n));
      range_in(c, variation, least);
      least = least.cwiseMin(here + direct_at(middles[n]));
      cell(c).off = (interpolated - here).cwiseAbs();
      is_cut[c] = may_cut && exceeds(*cell(c).off, options_.within, least);
      any |= is_cut[c] != 0;
    }
    if (any) cut_cells(is_cut);
    return any;
  }

  Cell& cell(std::uint32_t c) {
    const LayeredMesh& cells = result_.correction_.cells();
    const std::uint32_t parent = cells.parent[c];
    return cells_of_[parent][c - cells.first_cell[parent]];
  }

  void cut_cells(const std::vector<char>& is_cut) {
    const LayeredMesh& cells = result_.correction_.cells();
    for (std::uint32_t i = 0; i < cells_of_.size(); ++i) {
      std::vector<Cell> now;
      for (std::uint32_t c = cells.first_cell[i]; c < cells.first_cell[i + 1]; ++c) {
        if (!is_cut[c]) {
          now.push_back(std::move(cell(c)));
          continue;
        }
        for (Polygon& part : cut(cell(c).polygon)) now.push_back({std::move(part), {}});
      }
      cells_of_[i] = std::move(now);
    }
  }

  void bound_cells() {
    const CellField& field = result_.correction_;
    const PatchMesh& mesh = field.cells().mesh;
    result_.bound_ = BandMatrix::Zero(static_cast<Index>(mesh.size()), bands_);
    for (std::uint32_t c = 0; c < mesh.size(); ++c) {
      const Patch& patch = mesh.patches[c];
      if (field.node_of(patch, 0) == CellField::kNone) continue;
      auto bound = result_.bound_.row(c);
      for (std::size_t k = 0; k < patch.corner_count; ++k)
        bound = bound.cwiseMax(bound_of_nodes_.row(field.node_of(patch, k)));
      if (const auto& off = cell(c).off)
        bound += *off;
      else
        bound += kUntestedShare * variation_.row(c);
    }
  }

  const std::array<const GatheredField*, 3>& grids_;
  const RefinedFieldOptions& options_;
  const FieldSources& finest_;
  const Index bands_;
  RefinedField& result_;
  std::vector<std::vector<Cell>> cells_of_;  // of each element
  std::map<Key, Known> known_;
  // nodes x bands: correction on the finest grid, bound, irradiance with the lamps' light
  BandMatrix finest_of_nodes_, bound_of_nodes_, least_of_nodes_;
  BandMatrix variation_;  // of that correction, cells x bands
  Eigen::VectorXd smooth_at_, direct_at_;
  Gather::Scratch scratch_;
};

RefinedField::RefinedField(const std::array<const GatheredField*, 3>& grids,
                           const RefinedFieldOptions& options)
    : smooth_(&grids[0]->sources().smooth) {
  FieldRefinement(grids, options, *this).run();
}

void RefinedField::evaluate(std::uint32_t cell, const Vec3& point,
                            Eigen::Ref<Eigen::VectorXd> values) const {
  smooth_->evaluate(cells().parent[cell], point, values);
  correction_.add_to(cell, point, values);
  values = values.cwiseMax(0.0);
}

}  // namespace truebox

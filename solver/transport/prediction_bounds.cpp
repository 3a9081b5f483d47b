// SPDX-License-Identifier: BSD-3-Clause
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "transport/grid_difference.h"
#include "transport/prediction.h"

namespace truebox {
namespace {

using Eigen::Index;

// Exponent of B = B0 + c x^lambda at a right-angled edge of reflectance rho: the Mellin transform
// of the edge's kernel, 1 = (rho / 4) G(1 + l/2) G((1 - l)/2) / G(3/2); 0.763 at rho = 0.5.
double edge_exponent(double rho) {
  const auto excess = [rho](double l) {
    return 0.25 * rho * std::tgamma(1.0 + 0.5 * l) * std::tgamma(0.5 * (1.0 - l)) /
               std::tgamma(1.5) -
           1.0;
  };
  double low = 0.0, high = 1.0 - 1e-9;
  for (int step = 0; step < 60; ++step) {
    const double middle = 0.5 * (low + high);
    (excess(middle) > 0.0 ? high : low) = middle;
  }
  return 0.5 * (low + high);
}

// 1 / (2^lambda - 1) in each band: at a point the grids may converge as slowly as an edge does.
Eigen::VectorXd pointwise_factor(const Scene& scene) {
  Eigen::VectorXd factor(static_cast<Index>(scene.bands.size()));
  for (Index k = 0; k < factor.size(); ++k) {
    double rho = 0.0;
    for (const Material& m : scene.materials)
      rho = std::max(rho, m.reflectance[static_cast<std::size_t>(k)]);
    factor[k] = 1.0 / (std::exp2(edge_exponent(rho)) - 1.0);
  }
  return factor;
}

// Where another surface stands on this one the light turns around its corners within an element:
// by chance one of them may agree on all grids, so those that meet there share the largest.
void share_bounds_at_contacts(const PatchMesh& mesh, const std::vector<char>& usable,
                              BandMatrix& bound) {
  std::vector<std::vector<std::uint32_t>> patches_at(mesh.vertices.size());
  std::vector<char> is_contact(mesh.vertices.size(), 0);
  for (std::uint32_t i = 0; i < mesh.size(); ++i)
    for (std::uint32_t v : mesh.corners_of(mesh.patches[i])) {
      if (usable[i])
        patches_at[v].push_back(i);
      else
        is_contact[v] = 1;
    }
  const BandMatrix own = bound;
  for (std::size_t v = 0; v < patches_at.size(); ++v) {
    if (!is_contact[v]) continue;
    for (std::uint32_t i : patches_at[v])
      for (std::uint32_t j : patches_at[v]) bound.row(i) = bound.row(i).cwiseMax(own.row(j));
  }
}

}  // namespace

// A solver's bound holds for every element, so for any mean of them. What the form factors' own
// tolerance does is common to all grids and not in their difference; where the scene is closed, row
// sums show it: in a furnace it is the whole error. What links leave out is an estimate, root mean
// square; against full matrices it was up to 1.5 times too small. That of the coarser grids is in
// the difference between the grids.
Eigen::VectorXd Prediction::solver_bounds() const {
  constexpr double kLinksAtMost = 3.0;
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(fine().indirect.cols());
  for (const auto& level : levels_) sum += level->solution.solve.error_bound;
  if (fine().form_factors.closed) {
    // Rows that miss more than kernels can lie partly under another surface: an error of the grid.
    constexpr double kKernelsAtMost = 1e-3;
    double row_error = fine().form_factors.closure_residual_max;
    if (row_error > kKernelsAtMost && fine().form_factors.repair != ClosureRepair::none)
      row_error = FormFactorOptions{}.relative_tolerance;
    for (Index k = 0; k < sum.size(); ++k) {
      double rho = 0.0;
      for (const Material& m : distinct_scene_.materials)
        rho = std::max(rho, m.reflectance[static_cast<std::size_t>(k)]);
      const double q = rho * std::max(1.0, fine().form_factors.row_sum_max);
      if (q < 1.0) sum[k] += row_error * fine().reflected.col(k).cwiseAbs().maxCoeff() / (1.0 - q);
    }
  }
  if (!fine().links) return sum;
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(sum.size());
  double area_m2 = 0.0;
  for (std::size_t i = 0; i < fine().mesh.size(); ++i) {
    if (!fine().usable[i]) continue;
    const auto row = static_cast<Index>(i);
    mean +=
        fine().free_area_m2[row] * (fine().direct.row(row) + fine().indirect.row(row)).transpose();
    area_m2 += fine().free_area_m2[row];
  }
  if (area_m2 > 0.0) sum += kLinksAtMost * fine().links->relative_error / area_m2 * mean;
  return sum;
}

const BandMatrix& Prediction::indirect_bound() const {
  std::call_once(compared_, [this] { compare_grids(); });
  return indirect_bound_;
}

void Prediction::compare_grids() const {
  const PatchMesh& mesh = fine().mesh;
  const auto bands = fine().indirect.cols();
  indirect_bound_ = BandMatrix::Zero(fine().indirect.rows(), bands);
  if (!needs_.interreflection) return;
  const Eigen::VectorXd factor = pointwise_factor(distinct_scene_);
  const bool is_constant = levels_[0]->reconstruction == Reconstruction::constant;
  tbb::parallel_for(
      tbb::blocked_range<std::uint32_t>(0, static_cast<std::uint32_t>(mesh.size())),
      [&](const auto& range) {
        Eigen::VectorXd at[3] = {Eigen::VectorXd(bands), Eigen::VectorXd(bands),
                                 Eigen::VectorXd(bands)};
        for (std::uint32_t i = range.begin(); i < range.end(); ++i) {
          const Patch& patch = mesh.patches[i];
          std::uint32_t element[3] = {i, 0, 0};
          for (int k = 1; k < 3; ++k)
            element[k] = levels_[k]->smooth().find_patch(patch.piece, patch.centroid);
          if (!fine().usable[i]) continue;
          const auto compare = [&](const Vec3& point) {
            for (int k = 0; k < 3; ++k)
              if (is_constant)
                levels_[k]->smooth().evaluate(element[k], point, at[k]);
              else
                levels_[k]->evaluate(element[k], point, at[k]);
            Eigen::VectorXd guard = guarded_difference(at[0], at[1], at[2], kSmoothOrder);
            // Steps between elements say little of the slope within one: the smooth field does.
            if (is_constant) guard += (at[0] - fine().indirect.row(i).transpose()).cwiseAbs();
            const Eigen::VectorXd own = factor.cwiseProduct((at[0] - at[1]).cwiseAbs());
            indirect_bound_.row(i) =
                indirect_bound_.row(i).cwiseMax(guard.cwiseMax(own).transpose());
          };
          compare(patch.centroid);
          for (std::uint32_t v : mesh.corners_of(patch))
            compare(patch.centroid + 0.95 * (mesh.vertices[v] - patch.centroid));
        }
      });
  share_bounds_at_contacts(mesh, fine().usable, indirect_bound_);
  indirect_bound_.rowwise() += solver_bounds().transpose();
}

const RefinedField& Prediction::gathered_field() const {
  std::call_once(refined_, [this] { refine_gathered(); });
  return *gathered_field_;
}

void Prediction::refine_gathered() const {
  std::array<const GatheredField*, 3> grids;
  for (std::size_t k = 0; k < 3; ++k)
    grids[k] = &levels_[k]->gathered(distinct_scene_, needs_.occlusion);
  RefinedFieldOptions options;
  options.share = bound_is_reliable() ? 1.0 / kRichardson : 0.0;
  options.bound_factor = pointwise_factor(distinct_scene_);
  gathered_field_ = std::make_unique<RefinedField>(grids, options);
  const LayeredMesh& cells = gathered_field_->cells();
  std::vector<char> usable(cells.mesh.size());
  for (std::size_t c = 0; c < usable.size(); ++c) usable[c] = fine().usable[cells.parent[c]];
  gathered_bound_ = gathered_field_->bound();
  share_bounds_at_contacts(cells.mesh, usable, gathered_bound_);
  gathered_bound_.rowwise() += solver_bounds().transpose();
}

ErrorShares Prediction::find_error_shares(const Level& resampled) const {
  const PatchMesh& next = coarse().mesh;
  Eigen::RowVectorXd mean = Eigen::RowVectorXd::Zero(fine().direct.cols()), sampling = mean;
  double area = 0.0;
  for (std::size_t i = 0; i < next.size(); ++i) {
    const auto row = static_cast<Index>(i);
    if (!coarse().usable[i] || scene_->surfaces[next.surface_of(next.patches[i])].is_opening)
      continue;
    const double free_m2 = coarse().free_area_m2[row];
    area += free_m2;
    mean += free_m2 * (coarse().direct.row(row) + coarse().indirect.row(row));
    sampling +=
        free_m2 * (coarse().indirect.row(row) - resampled.solution.indirect.row(row)).cwiseAbs();
  }
  const BandMatrix bound = surface_irradiance_bound();
  Eigen::VectorXd grids = Eigen::VectorXd::Zero(bound.cols());
  for (std::size_t s = 0; s < scene_->surfaces.size(); ++s) {
    if (scene_->surfaces[s].is_opening) continue;
    double surface_m2 = 0.0;
    for (const Polygon& piece : scene_->surfaces[s].pieces) surface_m2 += area_vector(piece).norm();
    grids += surface_m2 * bound.row(static_cast<Index>(s)).transpose();
  }
  const Eigen::VectorXd total = expand(mean.transpose()), rays = expand(sampling.transpose()),
                        all_but_grids = expand(solver_bounds());
  // What rows still miss is the factors' doing, not the solver's; with links the two are not told
  // apart.
  Eigen::VectorXd solver = all_but_grids;
  if (!fine().links) {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(fine().indirect.cols());
    for (const auto& level : levels_) sum += level->solution.solve.error_bound;
    solver = expand(sum);
  }
  ErrorShares shares;
  for (Index k = 0; k < total.size(); ++k) {
    if (!(total[k] > 0.0)) continue;
    shares.form_factors =
        std::max(shares.form_factors, (rays[k] + (all_but_grids[k] - solver[k]) * area) / total[k]);
    shares.solver = std::max(shares.solver, solver[k] * area / total[k]);
    shares.discretisation =
        std::max(shares.discretisation, (grids[k] - all_but_grids[k] * area) / total[k]);
  }
  return shares;
}

}  // namespace truebox

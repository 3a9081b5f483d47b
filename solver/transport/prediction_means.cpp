// SPDX-License-Identifier: BSD-3-Clause
// Means of whole surfaces: extrapolated, with a bound from three grids.
#include <algorithm>
#include <cmath>

#include "transport/grid_difference.h"
#include "transport/prediction.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr double kSafety = 1.25;     // of an order that three grids show: Roache (1998)
constexpr double kLeastOrder = 1.0;  // taken where they show less, or nothing
// Of the coarsest grid on a surface: fewer agree with their children by chance, whatever the order.
constexpr int kElementsThatShowOrder = 4;

// What the extrapolated value may still be wrong by, over the difference between its two grids.
double left_of_difference(double order) {
  return std::max(1.0 / (std::exp2(order) - 1.0) - 1.0 / kRichardson, 1.0 / kRichardson);
}

}  // namespace

Prediction::SurfaceDifferences Prediction::surface_differences(std::size_t finer,
                                                               std::size_t coarser) const {
  const GridSolution& fine = levels_[finer]->solution;
  const GridSolution& next = levels_[coarser]->solution;
  BandMatrix children = BandMatrix::Zero(next.indirect.rows(), next.indirect.cols());
  Eigen::VectorXd children_area = Eigen::VectorXd::Zero(children.rows());
  for (std::size_t i = 0; i < fine.mesh.size(); ++i) {
    if (!fine.usable[i]) continue;
    const double area = fine.free_area_m2[static_cast<Index>(i)];
    const Patch& patch = fine.mesh.patches[i];
    const std::uint32_t parent = levels_[coarser]->smooth().find_patch(patch.piece, patch.centroid);
    children.row(parent) += area * fine.indirect.row(static_cast<Index>(i));
    children_area[parent] += area;
  }
  const auto surfaces = static_cast<Index>(scene_->surfaces.size());
  Eigen::VectorXd area = Eigen::VectorXd::Zero(surfaces);
  SurfaceDifferences sums;
  sums.with_sign = sums.without_sign = BandMatrix::Zero(surfaces, children.cols());
  for (std::size_t p = 0; p < next.mesh.size(); ++p) {
    const auto row = static_cast<Index>(p);
    const auto s = static_cast<Index>(next.mesh.surface_of(next.mesh.patches[p]));
    const Eigen::RowVectorXd difference =
        children.row(row) - children_area[row] * next.indirect.row(row);
    sums.with_sign.row(s) += difference;
    sums.without_sign.row(s) += difference.cwiseAbs();
    area[s] += children_area[row];
  }
  for (Index s = 0; s < surfaces; ++s) {
    if (!(area[s] > 0.0)) continue;
    sums.with_sign.row(s) /= area[s];
    sums.without_sign.row(s) /= area[s];
  }
  return sums;
}

BandMatrix Prediction::surface_irradiance_bound() const {
  if (!needs_.interreflection)
    return BandMatrix::Zero(static_cast<Index>(scene_->surfaces.size()),
                            static_cast<Index>(scene_->bands.size()));
  BandMatrix bound = surface_differences(0, 1).without_sign;
  bound.rowwise() += solver_bounds().transpose();
  return expand_rows(bound);
}

// Of the larger difference, each surface and band by the order that its grids show.
BandMatrix Prediction::bound_factors(const BandMatrix& finer, const BandMatrix& coarser) const {
  const GridSolution& last = coarsest();
  Eigen::VectorXi elements = Eigen::VectorXi::Zero(finer.rows());
  for (std::size_t i = 0; i < last.mesh.size(); ++i)
    if (last.usable[i]) ++elements[static_cast<Index>(last.mesh.surface_of(last.mesh.patches[i]))];
  BandMatrix factor(finer.rows(), finer.cols());
  for (Index s = 0; s < factor.rows(); ++s)
    for (Index k = 0; k < factor.cols(); ++k) {
      const bool shows_order = elements[s] >= kElementsThatShowOrder && finer(s, k) > 0.0;
      const double order = shows_order ? std::log2(coarser(s, k) / finer(s, k)) : kLeastOrder;
      factor(s, k) = kSafety * left_of_difference(std::clamp(order, kLeastOrder, kGatheredOrder));
    }
  return factor;
}

// Of the finest grid's elements, those that see nothing left out; distinct bands.
BandMatrix Prediction::surface_means_of_finest(Eigen::VectorXd& area_m2) const {
  const auto surfaces = static_cast<Index>(scene_->surfaces.size());
  BandMatrix mean = BandMatrix::Zero(surfaces, fine().direct.cols());
  area_m2 = Eigen::VectorXd::Zero(surfaces);
  for (std::size_t i = 0; i < fine().mesh.size(); ++i) {
    if (!fine().usable[i]) continue;
    const auto row = static_cast<Index>(i);
    const auto s = static_cast<Index>(fine().mesh.surface_of(fine().mesh.patches[i]));
    const double free_m2 = fine().free_area_m2[row];
    mean.row(s) += free_m2 * (fine().direct.row(row) + fine().indirect.row(row));
    area_m2[s] += free_m2;
  }
  for (Index s = 0; s < surfaces; ++s)
    if (area_m2[s] > 0.0) mean.row(s) /= area_m2[s];
  return mean;
}

SurfaceMeans Prediction::surface_means() const {
  SurfaceMeans means;
  BandMatrix mean = surface_means_of_finest(means.area_m2);
  means.error_bound = means.bound_in_order = surface_irradiance_bound();
  if (needs_.interreflection && bound_is_reliable()) {
    const SurfaceDifferences finer = surface_differences(0, 1);
    mean = (mean + finer.with_sign / kRichardson).cwiseMax(0.0);
    if (is_uniform_) {
      const BandMatrix coarser = surface_differences(1, 2).without_sign;
      const BandMatrix guarded = finer.without_sign.cwiseMax(std::exp2(-kGatheredOrder) * coarser);
      BandMatrix bound = guarded.cwiseProduct(bound_factors(finer.without_sign, coarser));
      BandMatrix in_order = kSafety * left_of_difference(kGatheredOrder) * finer.without_sign;
      bound.rowwise() += solver_bounds().transpose();
      in_order.rowwise() += solver_bounds().transpose();
      means.error_bound = expand_rows(bound);
      means.bound_in_order = expand_rows(in_order);
    }
  }
  means.irradiance = expand_rows(mean);
  means.error_bound += kRounding * means.irradiance;
  means.bound_in_order += kRounding * means.irradiance;
  return means;
}

}  // namespace truebox

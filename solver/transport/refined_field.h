// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "transport/gathered_field.h"

namespace truebox {

struct RefinedFieldOptions {
  /// Of the difference from the next grid, to extrapolate by (Richardson); 0: none.
  double share = 0.0;
  /// Of that difference, one value a band: what the finest grid can be wrong by.
  Eigen::VectorXd bound_factor;
  /// Cells are cut where interpolation is off by more than this part of the irradiance.
  double within = 5e-3;
  int deepest = 2;  ///< times a cell is cut
};

/// The gathered field, interpolated between as many points as that takes. Cells in which the
/// correction varies are tested: gathered in their middle, they are cut where that differs from
/// what interpolation says, again and again. So a wall follows the edge of a shadow on the floor
/// beside it, which elements, and corners an element apart, miss.
///
/// At every corner light is gathered on three grids (finest first), each sending its own field:
///   value = v_h + share (v_h - v_2h),
///   bound = factor |v_h - v_2h|, not less than |v_2h - v_4h| / 2^p, plus what extrapolation
///           moves, plus what interpolation was found to be off by.
/// Differences between grids are thus those of gathered light alone, not of interpolation.
/// Sources: Ward, Rubinstein & Clear (1988); Krivanek et al. (2005), adaptive caching.
class RefinedField {
 public:
  /// The grids must outlive the field.
  RefinedField(const std::array<const GatheredField*, 3>& grids,
               const RefinedFieldOptions& options);

  const LayeredMesh& cells() const { return correction_.cells(); }
  /// The cell of an element of the finest grid that holds a point.
  std::uint32_t find_cell(std::uint32_t patch, const Vec3& point) const {
    return correction_.find_cell(patch, point);
  }
  /// Indirect irradiance in each band at a point of a cell; never negative.
  void evaluate(std::uint32_t cell, const Vec3& point, Eigen::Ref<Eigen::VectorXd> values) const;
  /// Cells x bands.
  const BandMatrix& bound() const { return bound_; }
  /// Places at which light was gathered.
  std::size_t gathered_count() const { return gathered_count_; }

 private:
  friend class FieldRefinement;
  const SmoothField* smooth_;
  CellField correction_;
  BandMatrix bound_;
  std::size_t gathered_count_ = 0;
};

}  // namespace truebox

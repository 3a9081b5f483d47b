// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "mesh/cell_field.h"
#include "transport/gather.h"

namespace truebox {

/// One grid's solution, as a gathered field needs it. All must outlive the field.
struct FieldSources {
  const PatchMesh& mesh;
  const Scene& scene;  ///< in the bands of the solution
  const std::vector<char>& usable;
  const BandMatrix& reflected;  ///< mean reflected radiosity, elements x bands
  const SmoothField& smooth;    ///< of the indirect irradiance
  const Gather& gather;
  bool occlusion;
};

/// A point of an element.
struct GatherPlace {
  Vec3 point;
  std::uint32_t patch = 0;
};

/// Indirect irradiance on surfaces: the smooth field plus a correction that is gathered at the
/// corners of cells and interpolated between them. Cells get thinner towards the lines where
/// surfaces meet (edge_layers), so that the field follows the singularity B0 + c x^lambda there,
/// which polynomials on elements miss by 5 to 9 % at any size.
///
/// At a corner every source element counts by exact visibility: far ones send their mean, near
/// ones are split and their parts send direct light, exact, and the gathered field itself,
///   c(x) = gathered(x) - smooth(x) + sum_k F_xk rho_k c(y_k),
/// a sparse system, solved by iteration (it contracts by rho / 2 at an edge). Continuous inside a
/// piece, constants are reproduced exactly. Cost: corners x elements Lambert sums, about 0.2 us
/// each. Sources: Reichert (1992), final gather; Ward, Rubinstein & Clear (1988), interpolation of
/// gathered irradiance; Atkinson (1997), ch. 8, graded collocation at edges.
class GatheredField {
 public:
  explicit GatheredField(const FieldSources& sources);
  ~GatheredField();

  const FieldSources& sources() const { return sources_; }
  const LayeredMesh& cells() const { return correction_.cells(); }
  const CellField& correction() const { return correction_; }
  std::uint32_t find_cell(std::uint32_t patch, const Vec3& point) const {
    return correction_.find_cell(patch, point);
  }

  /// Values in each band at a point of a cell; never negative.
  void evaluate(std::uint32_t cell, const Vec3& point, Eigen::Ref<Eigen::VectorXd> values) const;

  /// Gathered once more, at any places: what the field interpolates. Places x bands; in parallel.
  BandMatrix gathered_at(const std::vector<GatherPlace>& places) const;

 private:
  using Weights = std::vector<CellField::Share>;  // of nodes' corrections
  struct Surroundings;
  class Collector;

  BandMatrix collect(const std::vector<GatherPlace>& places, std::vector<Weights>& weights) const;
  Eigen::RowVectorXd sent_by(const Weights& weights) const;
  void solve();

  FieldSources sources_;
  CellField correction_;
  std::unique_ptr<Surroundings> around_;  // none where nothing reflects
};

}  // namespace truebox

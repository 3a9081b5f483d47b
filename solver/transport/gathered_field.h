// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "mesh/edge_layers.h"
#include "mesh/smooth_field.h"
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

  const LayeredMesh& cells() const { return cells_; }
  /// The cell of element `patch` that holds a point (the nearest one if none does).
  std::uint32_t find_cell(std::uint32_t patch, const Vec3& point) const;

  /// This field plus `share` of its difference from a coarser grid's, taken at its corners.
  GatheredField extrapolated(const GatheredField& coarse, double share) const;

  /// Values in each band at a point of a cell; never negative.
  void evaluate(std::uint32_t cell, const Vec3& point, Eigen::Ref<Eigen::VectorXd> values) const;

 private:
  struct Node {
    Vec3 point;  // of the corner, a little inside where it lies on a rim
    std::uint32_t patch;
    bool is_hanging = false;
  };
  struct Weight {  // of a node's correction in that of another
    std::uint32_t node;
    double factor;
  };
  struct Hanging {
    std::uint32_t node, from, to;
    double share;
  };
  class Collector;

  void place_nodes();
  void gather_nodes(std::vector<std::vector<Weight>>& weights);
  void solve(const std::vector<std::vector<Weight>>& weights);
  void tie_hanging();

  FieldSources sources_;
  LayeredMesh cells_;
  std::vector<std::uint32_t> node_of_;  // for each entry of cells_.mesh.corners
  std::vector<Node> nodes_;
  std::vector<Hanging> hanging_;
  BandMatrix correction_;  // nodes x bands
};

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "mesh/patch_topology.h"
#include "mesh/smooth_field.h"

namespace truebox {

enum class VertexRule {
  averaged,      ///< mean of the elements around; extrapolated at borders
  least_squares  ///< the plane that fits the means of the elements around best
};

/// Radiosities of the vertices from the means of constant elements, and between them (bi)linear
/// interpolation. `averaged`: a vertex e inside a surface takes the mean of the elements around it;
/// a vertex b of a border, the nearest such e and the elements around b,
///   (B_b + B_e) / 2 = mean of the elements around b.
/// That is exact for linear radiosity on uniform elements only, and B_b may fall below 0.
/// `least_squares` is exact for linear radiosity on any elements. Second order where radiosity is
/// smooth. Jumps are kept where other surfaces touch and at elements that are not usable.
/// Sources: Cohen & Greenberg (1985); Cohen & Wallace (1993), ch. 6; least squares: Zienkiewicz &
/// Zhu (1992).
class VertexRadiosity {
 public:
  /// `means`: elements x bands; `usable`: one flag an element.
  VertexRadiosity(const PatchMesh& mesh, const std::vector<char>& usable, const BandMatrix& means,
                  VertexRule rule);

  /// Of corner k of element `patch`, one value a band.
  Eigen::VectorXd at_corner(std::uint32_t patch, std::size_t k) const;

  /// Values in each band at a point of element `patch`.
  void evaluate(std::uint32_t patch, const Vec3& point, Eigen::Ref<Eigen::VectorXd> values) const;

 private:
  const PatchMesh* mesh_;
  std::vector<std::uint32_t> corner_of_;  // for each entry of mesh.corners, row of values_
  BandMatrix values_;
};

}  // namespace truebox

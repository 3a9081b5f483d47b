// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "mesh/patch_mesh.h"

namespace truebox {

/// One row an element, one column a band.
using BandMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// A smooth function on every piece from its element means:
///   f(x) = sum_c lambda_c(x) q_c(x),
/// q_c the quadratic that fits the means of the elements around corner c best (least squares, a
/// plane or a constant where neighbours are few), lambda_c Wachspress coordinates in the element.
/// Continuous inside a piece, also where larger elements meet smaller ones (a corner that hangs in
/// an edge takes the blend of the quadratics of its ends); third order in the element size where f
/// is smooth; jumps are kept where another surface touches (contact lines) and at elements that are
/// not `usable`.
/// Sources: Wachspress (1975); partition of unity: Babuska & Melenk (1997).
class SmoothField {
 public:
  /// `means`: elements x bands; `usable`: one flag an element (a buried one would drag in its
  /// dark).
  SmoothField(const PatchMesh& mesh, const std::vector<char>& usable, const BandMatrix& means);

  /// Values in each band at a point of element `patch`; negative overshoot is cut off at 0.
  void evaluate(std::uint32_t patch, const Vec3& point, Eigen::Ref<Eigen::VectorXd> values) const;

  /// The element of a piece that holds a point of its plane (the nearest one if none does).
  std::uint32_t find_patch(std::uint32_t piece, const Vec3& point) const;

 private:
  struct Corner {
    Vec3 origin, axis_u, axis_v;
    double size_m;
    BandMatrix coefficients;  // 1, u, v, uu, uv, vv  x bands
  };
  static void fit_corner(const PatchMesh& mesh, const std::vector<std::uint32_t>& neighbours,
                         const BandMatrix& means, Corner& corner);
  static BandMatrix seen_from(const Corner& corner, const Corner& place);

  const PatchMesh* mesh_;
  std::vector<std::uint32_t> corner_of_;  // for each entry of mesh.corners, into corners_
  std::vector<Corner> corners_;
  struct Bins {
    Vec3 origin, axis_u, axis_v;
    double cell_m = 1.0;
    int columns = 1, rows = 1;
    std::vector<std::vector<std::uint32_t>> patches;
  };
  std::vector<Bins> bins_;  // one a piece
};

}  // namespace truebox

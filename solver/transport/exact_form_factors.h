// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "mesh/patch_mesh.h"
#include "transport/closure_repair.h"

namespace truebox {

struct ExactFormFactorOptions {
  double relative_tolerance = 1e-4;  ///< of the unoccluded kernel, each pair
  bool occlusion = true;             ///< false where the scene cannot block (see Requirements)
  /// 2, 3 or 4: partly hidden pairs are seen from that many squared points of one patch, the one
  /// over which the shadows change less, each with the exact outlines of the shadows. 0: exact
  /// visibility, adaptive to relative_tolerance.
  int outline_points = 3;
  /// Twice as many points a direction where these points find the form factor of the smaller patch
  /// rougher than this.
  double outline_tolerance = 3e-4;
};

/// All pairs of a mesh without rays and without noise, as one symmetric matrix of exchange areas
/// A_i F_ij (m^2); Scalar is float (4 bytes a pair) or double (8).
template <class Scalar>
struct ExactFormFactors {
  Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic> exchange_area_m2;
  Eigen::VectorXd area_m2;
  std::vector<char> usable;  ///< 0: sees less than 1e-4 of what a closed scene shows, as if buried
  /// Pairs i < j whose visibility is a quadrature: what closure may be repaired through.
  std::vector<std::vector<std::uint32_t>> partial;
  std::size_t pairs_unoccluded = 0, pairs_hidden = 0, pairs_partial = 0;

  /// sum_j F_ij - 1 of the usable rows, area-weighted rms: 0 in a closed scene.
  double closure_rms() const;
};

/// Shafts decide for whole groups of pairs: nothing in between, the kernel alone; one blocker
/// across, nothing; the rest by `outline_points`. See PairPlanner, PairKernel, hidden_share and
/// visible_exchange for equations and sources. Throws std::length_error above `memory_limit_bytes`.
template <class Scalar>
ExactFormFactors<Scalar> exact_form_factors(const PatchMesh& mesh, const Scene& scene,
                                            const ExactFormFactorOptions& options,
                                            std::size_t memory_limit_bytes = std::size_t{8} << 30);

/// One row at a time, where a full matrix is not asked for: `visit(i, row)` with row[j] = A_i F_ij,
/// m^2, the same numbers as in the matrix, in any order and from any thread. Memory n numbers a
/// thread; twice the time of the matrix, because nothing is mirrored.
void stream_form_factors(
    const PatchMesh& mesh, const Scene& scene, const ExactFormFactorOptions& options,
    const std::function<void(std::size_t i, std::span<const double> row_m2)>& visit);

/// One row and how its pairs came about; valid during the visit.
struct FormFactorRow {
  std::size_t patch = 0;
  std::span<const double> exchange_area_m2;  ///< A_i F_ij of every patch j
  std::span<const std::uint32_t> partial;    ///< those j whose visibility is a quadrature
  std::size_t unoccluded = 0, hidden = 0;    ///< pairs of this row; each is in two rows
};

/// The same for the rows from `begin` to before `end` only.
void stream_form_factors(const PatchMesh& mesh, const Scene& scene,
                         const ExactFormFactorOptions& options, std::size_t begin, std::size_t end,
                         const std::function<void(const FormFactorRow& row)>& visit);

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "mesh/patch_mesh.h"
#include "mesh/smooth_field.h"
#include "transport/gather.h"

namespace truebox {

/// What element means of the irradiance lack because an element close by, on another piece, is not
/// of one brightness:
///   dH_i = 1 / (free A_i)  sum over near j  int_j F(y -> i) (B(y) - B_j) dA_y
/// with F(y -> i) the exactly visible view factor from y to element i, and
///   B(y) = direct_share_j (irradiance straight from the luminaires at y) + (smooth field of rest).
/// Where two walls meet this is the largest error of constant elements: a wall that darkens into an
/// edge counts as bright there as in its middle. Elements are near within three sums of their
/// radii; those that another surface covers in part send nothing more, for what is bright there is
/// not their mean. All matrices elements x bands; `rest` and the result in W m^-2 nm^-1.
BandMatrix near_source_correction(const PatchMesh& mesh, const Scene& scene, const Gather& gather,
                                  const std::vector<char>& usable,
                                  const Eigen::VectorXd& free_area_m2,
                                  const BandMatrix& direct_share, const BandMatrix& rest);

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "alignment/camera_parameters.h"
#include "alignment/edge_field.h"
#include "alignment/scene_edges.h"

namespace truebox {

/// How far from the truth the guess may be.
struct SearchReach {
  double rotation_rad = 0.21;  ///< about any axis; a little over ten degrees, so that ten is inside
  double scale = 0.21;         ///< of distance and focal length together
};

/// Mean over the samples of min(distance to the nearest edge of like direction, cap) / cap, in
/// [0, 1]; 0: every sample lies on an edge of the picture. Samples off the picture count as 1.
double edge_distance_score(const CameraParameters& parameters,
                           const std::vector<EdgeSample>& samples, const EdgeField& field,
                           double cap_px);

/// The best starting points on a grid about the guess, best first, none within one step of
/// another: where the box's centre appears (two angles), how it is turned about itself (three) and
/// its size. Chamfer matching by direction: Barrow, Tenenbaum, Bolles, Wolf (1977), IJCAI; Liu,
/// Tuzel, Veeraraghavan, Chellappa (2010), CVPR.
std::vector<CameraParameters> pose_candidates(const CameraParameters& guess,
                                              const std::vector<EdgeSample>& samples,
                                              const EdgeField& field, const SearchReach& reach,
                                              std::size_t count);

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>

#include "alignment/edge_planes.h"

namespace truebox {

/// A straight piece of edge in a picture: where it is expected and how wide a window to read.
struct EdgeWindow {
  PixelPosition centre;            ///< px of the planes
  std::array<double, 2> normal{};  ///< unit
  double half_length_px = 6.0;     ///< along the edge
  double half_width_px = 5.0;      ///< across
};

struct LocalisedEdge {
  double offset_px = 0.0;  ///< along the normal from the window's centre
  double u_px = 0.0;       ///< standard uncertainty from the window's own noise
  double blur_px = 0.0;    ///< standard deviation of the lens' and sensor's Gaussian blur
  double contrast = 0.0;   ///< step, in units of the planes
  double noise = 0.0;      ///< standard deviation of the pixels about the model
};

/// Where a step edge runs through a window: least squares over its pixels of
///   I(d) = a + b d + (c + e d) S(d - s),
/// d the pixel centre's distance from the window's centre along the normal, S a unit step blurred
/// by a Gaussian and by the pixel's own square (exact for every direction of the edge). A step that
/// is only blurred has its edge at 50 %; b and e take up shading that is linear on each side, as
/// light between walls is not quite where they touch: what is not linear biases s.
/// In several planes, their combination with the largest step is used.
/// Nothing where there is no step (under 4 sigma), or it is not well inside the window, or u
/// exceeds 1 px.
std::optional<LocalisedEdge> localised_edge(const EdgePlanes& planes, const EdgeWindow& window);

/// S and its derivative by d and by sigma at distance d from the edge. Integrals of the normal
/// distribution over the square's projection, itself the convolution of two boxes |n_x| and |n_y|
/// wide.
struct BlurredStep {
  double value = 0.0, by_distance = 0.0, by_sigma = 0.0;
};
BlurredStep blurred_step(double d_px, double sigma_px, const std::array<double, 2>& normal);

}  // namespace truebox

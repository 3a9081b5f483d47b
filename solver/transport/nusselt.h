// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "scene/polygon.h"

namespace truebox {

/// Nusselt's analog: a polygon seen from `point` is projected to the unit hemisphere about `normal`
/// and from there straight down to the disc; its area over pi is the view factor of the element.
/// Outline of that projection in the disc, each edge as `arcs` chords of its elliptic arc. Empty
/// where the polygon lies below the horizon or shows its back; cut at the horizon otherwise.
/// The frame of the disc is (t, b), t = normal.unitOrthogonal(), b = normal x t.
/// Source: Nusselt (1928).
std::vector<Eigen::Vector2d> nusselt_outline(const Vec3& point, const Vec3& normal,
                                             std::span<const Vec3> polygon, int arcs);

/// Area of the outline over pi: short of the view factor by a term in 1 / arcs^2.
double nusselt_factor(const Vec3& point, const Vec3& normal, std::span<const Vec3> polygon,
                      int arcs);

}  // namespace truebox

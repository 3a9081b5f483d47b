// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "scene/scene.h"

namespace truebox {

/// A segment in which another surface touches a piece, m.
struct ContactLine {
  Vec3 from = Vec3::Zero();
  Vec3 to = Vec3::Zero();
};

/// Edges of other surfaces that lie in the plane of `piece` and cross its inside: the D0
/// discontinuities of its radiosity. Source: Heckbert (1992), Lischinski et al. (1992).
std::vector<ContactLine> contact_lines(const Polygon& piece, const Scene& scene);

/// Whether another surface, openings excepted, crosses the inside of a convex polygon of the scene:
/// it stands on it, lies on it with an edge or goes through it.
bool is_crossed(const Polygon& cell, const Scene& scene);

/// Cuts convex cells along the lines that cross their inside; a line cuts the whole cell.
std::vector<Polygon> cut_along(const std::vector<Polygon>& cells,
                               const std::vector<ContactLine>& lines, const Vec3& normal);

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "transport/prediction.h"

namespace truebox {

/// A solution as triangles with values at their corners, for viewers. Openings and elements that
/// lie under another surface are left out. Corners of one element edge share a vertex where the
/// radiosity is continuous; where it jumps (contact lines, edges between walls) each side has its
/// own. A corner that hangs in the edge of another element, on another wall as well, is a vertex of
/// that element too, at the same place to the last bit: no cracks.
struct SolutionSurface {
  std::vector<Vec3> positions_m;         ///< one a vertex
  std::vector<std::uint32_t> triangles;  ///< three vertices each, right-hand normal to the lit side
  std::vector<std::uint32_t> outlines;   ///< two vertices each: the edges of the elements
  std::vector<std::uint32_t> surface;    ///< of each triangle, into Scene::surfaces
  BandMatrix radiosity;                  ///< vertices x bands, W m^-2 nm^-1
  BandMatrix error_bound;                ///< of that radiosity, likewise
};

/// Own exitance plus rho times the irradiance at each corner (direct light exact, indirect from the
/// gathered field), a thousandth of the element inside it, so that an edge belongs to one side.
/// Bounds hold at the vertices; what a viewer interpolates between them may miss a shadow's edge.
SolutionSurface solution_surface(const Prediction& prediction);

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "mesh/patch_mesh.h"

namespace truebox {

/// As many elements as uniform_mesh makes, on quads crowded towards the edges where another surface
/// meets them: at distance t^power there where uniform ones are at t (`power` >= 1; from both sides
/// to the middle where both meet others). With power (p + 1) / lambda, polynomials of degree p
/// follow the singularity x^lambda of an edge as fast as a smooth function; much less already
/// helps. Source: Rice (1969); Atkinson (1997), ch. 8.
PatchMesh graded_mesh(const Scene& scene, double edge_m, double power, int level = 0);

}  // namespace truebox

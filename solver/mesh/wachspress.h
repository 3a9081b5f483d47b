// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "mesh/patch_mesh.h"

namespace truebox {

inline constexpr std::size_t kMaxPatchCorners = 16;
using WachspressWeights = std::array<double, kMaxPatchCorners>;

/// Generalised barycentric coordinates of a point of an element, one a corner, nowhere negative,
/// summing to 1: linear on triangles, bilinear on parallelograms. Returns the number of corners.
/// Source: Wachspress (1975).
std::size_t wachspress_weights(const PatchMesh& mesh, const Patch& patch, const Vec3& point,
                               WachspressWeights& weights);

}  // namespace truebox

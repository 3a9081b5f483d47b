// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "transport/element_tree.h"

namespace truebox {

inline constexpr int kGroupSamples = 16;

/// Points of a group of elements relative to its centre, m, the normals there, and weights that sum
/// to 1. Groups that fill a quadrilateral have 4 x 4 Gauss points, others a point at random of each
/// sixteenth of their area. Floats: their rounding is 1e-7 of the group's size.
struct GroupSamples {
  float x[kGroupSamples], y[kGroupSamples], z[kGroupSamples];
  float nx[kGroupSamples], ny[kGroupSamples], nz[kGroupSamples];
  float weight[kGroupSamples];

  Vec3 point(const ElementNode& node, int k) const { return node.centre + Vec3(x[k], y[k], z[k]); }
  Vec3 normal(int k) const { return Vec3(nx[k], ny[k], nz[k]); }
};

/// For every node of a tree; the same for the same seed.
std::vector<GroupSamples> group_samples(const PatchMesh& mesh, const ElementTree& tree,
                                        std::uint64_t seed);

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/wachspress.h"

#include <algorithm>
#include <cmath>

namespace truebox {

std::size_t wachspress_weights(const PatchMesh& mesh, const Patch& patch, const Vec3& point,
                               WachspressWeights& weights) {
  const auto corners = mesh.corners_of(patch);
  const Vec3& normal = mesh.plane_of(patch).normal;
  const std::size_t n = corners.size(), count = std::min(n, kMaxPatchCorners);
  WachspressWeights depth;
  const auto vertex = [&](std::size_t k) -> const Vec3& { return mesh.vertices[corners[k % n]]; };
  const double floor_m = 1e-9 * std::sqrt(patch.area_m2);
  for (std::size_t k = 0; k < count; ++k) {
    const Vec3 along = vertex(k + 1) - vertex(k);
    depth[k] = std::max(floor_m, normal.cross(along).dot(point - vertex(k)) / along.norm());
  }
  double total = 0.0;
  for (std::size_t k = 0; k < count; ++k) {
    const Vec3 before = (vertex(k) - vertex(k + n - 1)).normalized();
    const Vec3 after = (vertex(k + 1) - vertex(k)).normalized();
    weights[k] =
        std::max(0.0, normal.dot(before.cross(after))) / (depth[(k + n - 1) % n] * depth[k]);
    total += weights[k];
  }
  for (std::size_t k = 0; k < count; ++k) weights[k] /= total;
  return count;
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "scene/polygon.h"

namespace truebox {

using Triangle = std::array<Vec3, 3>;  ///< vertices, m

/// Triangles that rays are asked about together; a ray meets the groups in its mask.
struct TriangleGroup {
  std::vector<Triangle> triangles;
  std::uint32_t mask = 1;
};

/// Which triangle a ray meets first (Embree). Geometry and nothing else: sides, surfaces, openings
/// and how far a ray starts off its surface are for those who ask, each in their own way. Embree
/// computes in float: coordinates are centred and scaled to a diagonal of 2 first.
class TriangleRays {
 public:
  /// std::invalid_argument if no group has a triangle.
  explicit TriangleRays(const std::vector<TriangleGroup>& groups);
  ~TriangleRays();
  TriangleRays(TriangleRays&&) noexcept;
  TriangleRays& operator=(TriangleRays&&) noexcept;

  struct Hit {
    std::uint32_t group = 0;
    std::uint32_t triangle = 0;
    double distance_m = 0.0;  ///< float precision: 1e-7 of the diagonal
  };

  /// Along a unit direction.
  std::optional<Hit> first_hit(const Vec3& origin, const Vec3& direction, std::uint32_t mask) const;

  /// Whether anything of the mask stands between two points.
  bool occluded(const Vec3& from, const Vec3& to, std::uint32_t mask) const;

  double diagonal_m() const;  ///< of the bounding box of all triangles

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// A convex polygon as a fan of triangles about its first vertex.
std::vector<Triangle> fan(const Polygon& polygon);

}  // namespace truebox

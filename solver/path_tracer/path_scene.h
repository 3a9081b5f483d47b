// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "path_tracer/owen_sobol.h"
#include "rays/triangle_rays.h"
#include "scene/scene.h"

namespace truebox {

/// A scene as paths meet it: flat faces with two sides, and the lamps among them. The back of an
/// opaque face is black and blocks; openings are not there. The scene must outlive it.
class PathScene {
 public:
  explicit PathScene(const Scene& scene);

  struct Face {
    Plane plane;
    Vec3 tangent = Vec3::UnitX();
    const Material* material = nullptr;
    bool two_sided = false;
    double lamp_density_per_m2 = 0.0;  ///< of `lamp_point`, on this face
  };

  struct Hit {
    const Face* face = nullptr;
    Vec3 point = Vec3::Zero();
    Vec3 normal = Vec3::UnitZ();  ///< on the side the ray came from
    bool front = false;  ///< a side that is lit, reflects and emits; always so if two-sided
  };
  std::optional<Hit> first_hit(const Vec3& origin, const Vec3& direction) const;

  /// Whether light gets from one point to another; each is lifted off its face to the side its
  /// normal points to.
  bool sees(const Vec3& from, const Vec3& from_normal, const Vec3& to, const Vec3& to_normal) const;

  /// A point from which a ray may start to that side of its face.
  Vec3 lifted(const Vec3& point, const Vec3& normal) const { return point + offset_m_ * normal; }

  struct LampPoint {
    const Face* face = nullptr;
    Vec3 point = Vec3::Zero();
  };
  /// A point of a lamp: uniform on it, the lamp in proportion to its exitance summed over bands
  /// times its area. Nothing if the scene is dark.
  std::optional<LampPoint> lamp_point(UnitPair position, double choice) const;

 private:
  struct LampCell {  // a parallelogram, or the half of it that is a triangle
    std::size_t face = 0;
    Vec3 corner, edge_u, edge_v;
    bool is_triangle = false;
    double cumulative = 0.0;
  };
  void add_lamp(std::size_t face, const Polygon& polygon);

  std::vector<Face> faces_;
  std::vector<std::uint32_t> face_of_;  // triangle -> face
  std::vector<LampCell> lamps_;
  std::optional<TriangleRays> rays_;
  double offset_m_ = 0.0;
};

}  // namespace truebox

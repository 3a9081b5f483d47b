// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "mesh/patch_mesh.h"

namespace truebox {

/// Ray queries against a scene's pieces. Surfaces block light from both sides, openings do not.
/// The rays compute in float: end points are lifted off their surface by `offset_m`.
class Visibility {
 public:
  /// What a ray meets first; the point is recomputed in double on the piece's plane.
  struct Hit {
    std::uint32_t piece = 0;
    double distance_m = 0.0;
    Vec3 point = Vec3::Zero();
    bool front = false;  ///< the lit side was met
  };

  explicit Visibility(const PatchMesh& mesh, const Scene& scene);
  ~Visibility();
  Visibility(Visibility&&) noexcept;

  /// Whether anything stands between two points of surfaces with the given normals.
  bool occluded(const Vec3& from, const Vec3& from_normal, const Vec3& to,
                const Vec3& to_normal) const;

  /// First surface along a ray (unit direction), openings included if `with_openings`.
  std::optional<Hit> first_hit(const Vec3& origin, const Vec3& direction,
                               bool with_openings = false) const;

  /// 4e-6 of the scene's diagonal: float rounding of unit coordinates is 6e-8, intersection adds a
  /// few such steps (Waechter & Binder 2019 discuss the trade).
  double offset_m() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace truebox

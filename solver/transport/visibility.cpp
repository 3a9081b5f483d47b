// SPDX-License-Identifier: BSD-3-Clause
#include "transport/visibility.h"

#include <cmath>
#include <vector>

#include "rays/triangle_rays.h"

namespace truebox {

namespace {
constexpr unsigned kSurfaceMask = 1, kOpeningMask = 2;
}

struct Visibility::Implementation {
  const PatchMesh* mesh = nullptr;
  std::optional<TriangleRays> rays;
  double offset_m = 0.0;
  std::vector<std::uint32_t> piece_of[2];  // triangle -> piece: surfaces, openings
  std::vector<std::uint32_t> back_of;      // piece -> the piece on its back, or itself

  // The two sides of a surface are one sheet: rays meet the front, `back_of` names the other.
  void pair_sides(const Scene& truebox_scene) {
    back_of.resize(mesh->pieces.size());
    for (std::uint32_t p = 0; p < back_of.size(); ++p) back_of[p] = p;
    for (std::uint32_t first = 0; first < back_of.size();) {
      const std::size_t s = mesh->pieces[first].surface;
      const auto count = static_cast<std::uint32_t>(truebox_scene.surfaces[s].pieces.size());
      if (truebox_scene.surfaces[s].two_sided)
        for (std::uint32_t k = 0; k < count / 2; ++k) {
          back_of[first + k] = first + k + count / 2;
          back_of[first + k + count / 2] = first + k;
        }
      first += count;
    }
  }

  TriangleGroup group(const Scene& scene, bool openings) {
    TriangleGroup all{{}, openings ? kOpeningMask : kSurfaceMask};
    for (std::uint32_t p = 0; p < mesh->pieces.size(); ++p) {
      const Piece& piece = mesh->pieces[p];
      if (scene.surfaces[piece.surface].is_opening != openings) continue;
      if (back_of[p] < p) continue;  // the front stands for both
      for (const Triangle& triangle : fan(piece.polygon)) {
        all.triangles.push_back(triangle);
        piece_of[openings ? 1 : 0].push_back(p);
      }
    }
    return all;
  }
};

Visibility::Visibility(const PatchMesh& mesh, const Scene& scene)
    : implementation_(std::make_unique<Implementation>()) {
  Implementation& self = *implementation_;
  self.mesh = &mesh;
  self.pair_sides(scene);
  self.rays.emplace(std::vector{self.group(scene, false), self.group(scene, true)});
  self.offset_m = 4e-6 * self.rays->diagonal_m();
}

Visibility::~Visibility() = default;
Visibility::Visibility(Visibility&&) noexcept = default;

double Visibility::offset_m() const { return implementation_->offset_m; }

bool Visibility::occluded(const Vec3& from, const Vec3& from_normal, const Vec3& to,
                          const Vec3& to_normal) const {
  const Implementation& self = *implementation_;
  return self.rays->occluded(from + self.offset_m * from_normal, to + self.offset_m * to_normal,
                             kSurfaceMask);
}

std::optional<Visibility::Hit> Visibility::first_hit(const Vec3& origin, const Vec3& direction,
                                                     bool with_openings) const {
  const Implementation& self = *implementation_;
  const auto met = self.rays->first_hit(origin, direction,
                                        with_openings ? kSurfaceMask | kOpeningMask : kSurfaceMask);
  if (!met) return std::nullopt;
  Hit hit;
  hit.piece = self.piece_of[met->group][met->triangle];
  if (self.mesh->pieces[hit.piece].plane.normal.dot(direction) > 0.0)
    hit.piece = self.back_of[hit.piece];
  const Plane& plane = self.mesh->pieces[hit.piece].plane;
  const double cosine = plane.normal.dot(direction);
  hit.front = cosine < 0.0;
  hit.distance_m = met->distance_m;
  // Away from grazing rays the plane's own equation is far better than float.
  if (std::abs(cosine) > 1e-3) hit.distance_m = -plane.distance_m(origin) / cosine;
  hit.point = origin + hit.distance_m * direction;
  return hit;
}

}  // namespace truebox

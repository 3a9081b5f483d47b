// SPDX-License-Identifier: BSD-3-Clause
#include "path_tracer/path_scene.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace truebox {
namespace {

constexpr std::uint32_t kFaces = 1;

// Of the scene's diagonal: rays compute in float, 1e-7 a step, and a start point that falls behind
// its own face would leak.
constexpr double kOffset = 2e-6;

double total_exitance(const Material& material) {
  const auto& values = material.exitance.values;
  return std::accumulate(values.begin(), values.end(), 0.0);
}

bool is_parallelogram(const Polygon& p) {
  return p.size() == 4 && (p[0] - p[1] + p[2] - p[3]).norm() < 1e-12 * diameter_m(p);
}

}  // namespace

PathScene::PathScene(const Scene& scene) {
  TriangleGroup group{{}, kFaces};
  for (const Surface& surface : scene.surfaces) {
    if (surface.is_opening) continue;
    // The backs of a two-sided surface are listed too; one face stands for both.
    const std::size_t count = surface.pieces.size() / (surface.two_sided ? 2 : 1);
    for (std::size_t k = 0; k < count; ++k) {
      const Polygon& polygon = surface.pieces[k];
      Face face;
      face.plane = plane_of(polygon);
      face.tangent = (polygon[1] - polygon[0]).normalized();
      face.material = &scene.material_of(surface);
      face.two_sided = surface.two_sided;
      for (const Triangle& triangle : fan(polygon)) {
        group.triangles.push_back(triangle);
        face_of_.push_back(static_cast<std::uint32_t>(faces_.size()));
      }
      faces_.push_back(face);
      if (face.material->emits()) add_lamp(faces_.size() - 1, polygon);
    }
  }
  rays_.emplace(std::vector{std::move(group)});
  offset_m_ = kOffset * rays_->diagonal_m();
  if (lamps_.empty()) return;
  const double total = lamps_.back().cumulative;
  for (LampCell& cell : lamps_) cell.cumulative /= total;
  for (Face& face : faces_) face.lamp_density_per_m2 = total_exitance(*face.material) / total;
}

void PathScene::add_lamp(std::size_t face, const Polygon& polygon) {
  const auto add = [&](const Vec3& a, const Vec3& b, const Vec3& c, bool is_triangle) {
    LampCell cell{face, a, b - a, c - a, is_triangle, 0.0};
    const double area = (is_triangle ? 0.5 : 1.0) * cell.edge_u.cross(cell.edge_v).norm();
    cell.cumulative = (lamps_.empty() ? 0.0 : lamps_.back().cumulative) +
                      area * total_exitance(*faces_[face].material);
    lamps_.push_back(cell);
  };
  if (is_parallelogram(polygon)) {  // in one piece the numbers stay evenly spread
    add(polygon[0], polygon[1], polygon[3], false);
    return;
  }
  for (const Triangle& t : fan(polygon)) add(t[0], t[1], t[2], true);
}

std::optional<PathScene::Hit> PathScene::first_hit(const Vec3& origin,
                                                   const Vec3& direction) const {
  const auto met = rays_->first_hit(origin, direction, kFaces);
  if (!met) return std::nullopt;
  const Face& face = faces_[face_of_[met->triangle]];
  const bool from_front = face.plane.normal.dot(direction) < 0.0;
  Hit hit;
  hit.face = &face;
  hit.point = origin + met->distance_m * direction;
  hit.point -= face.plane.distance_m(hit.point) * face.plane.normal;  // float distance, exact plane
  hit.normal = from_front ? face.plane.normal : Vec3(-face.plane.normal);
  hit.front = from_front || face.two_sided;
  return hit;
}

bool PathScene::sees(const Vec3& from, const Vec3& from_normal, const Vec3& to,
                     const Vec3& to_normal) const {
  return !rays_->occluded(lifted(from, from_normal), lifted(to, to_normal), kFaces);
}

std::optional<PathScene::LampPoint> PathScene::lamp_point(UnitPair at, double choice) const {
  if (lamps_.empty()) return std::nullopt;
  const auto cell =
      std::lower_bound(lamps_.begin(), lamps_.end() - 1, choice,
                       [](const LampCell& lamp, double value) { return lamp.cumulative < value; });
  if (cell->is_triangle) {  // folded along the diagonal; Turk (1990)
    const double root = std::sqrt(at.u);
    at = {root * (1.0 - at.v), root * at.v};
  }
  return LampPoint{&faces_[cell->face], cell->corner + at.u * cell->edge_u + at.v * cell->edge_v};
}

}  // namespace truebox

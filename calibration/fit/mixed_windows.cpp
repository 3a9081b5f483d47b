// SPDX-License-Identifier: BSD-3-Clause
// What a window with edges in it shows, by clipping polygons.
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "fit/view_blocks.h"
#include "transport/visible_parts.h"

namespace truebox {
namespace {

/// The pyramid of rays through a rectangle of pixels.
struct Pyramid {
  Vec3 apex = Vec3::Zero();
  std::array<Plane, 4> sides;  ///< normals point inwards
  double film_area = 0.0;      ///< in normalised image coordinates
};

/// A direction's place in the plane at distance 1 before the camera.
Vec3 on_film(const Camera& camera, const Vec3& point_m) {
  const Vec3 p = camera.camera_from_world(point_m);
  return {p.x() / p.z(), p.y() / p.z(), 1.0};
}

std::optional<Pyramid> pyramid_of(const Camera& camera, const PixelRectangle& r) {
  const double corners[4][2] = {{0, 0}, {0, 1}, {1, 1}, {1, 0}};
  std::array<Vec3, 4> direction;
  Polygon film;
  Pyramid pyramid;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto ray = camera.ray({r[0] + corners[k][0] * r[2], r[1] + corners[k][1] * r[3]});
    if (!ray) return std::nullopt;
    direction[k] = ray->direction;
    pyramid.apex = ray->origin_m;
    film.push_back(on_film(camera, ray->origin_m + ray->direction));
  }
  const Vec3 middle = direction[0] + direction[1] + direction[2] + direction[3];
  for (std::size_t k = 0; k < 4; ++k) {
    Vec3 normal = direction[k].cross(direction[(k + 1) % 4]).normalized();
    if (normal.dot(middle) < 0.0) normal = -normal;
    pyramid.sides[k] = {normal, normal.dot(pyramid.apex)};
  }
  pyramid.film_area = area_vector(film).norm();
  return pyramid;
}

/// Sums of one piece over the rectangles of a window, in areas on the film.
struct Sum {
  double area = 0.0;
  Vec3 first_moment = Vec3::Zero();  // of points on the piece
  std::vector<Vec3> points;
  std::vector<double> areas;
};

/// The film's middle of a triangle stands for it: corners count by one over their depth.
void add_triangle(const Camera& camera, const std::array<Vec3, 3>& corner, int halvings, Sum& sum) {
  std::array<double, 3> nearness{};
  for (std::size_t k = 0; k < 3; ++k) nearness[k] = 1.0 / camera.camera_from_world(corner[k]).z();
  const auto middle = [&](std::size_t i, std::size_t j) -> Vec3 {
    return (nearness[i] * corner[i] + nearness[j] * corner[j]) / (nearness[i] + nearness[j]);
  };
  if (halvings > 0) {  // through the middles of the sides as the film sees them
    const std::array<Vec3, 3> m = {middle(0, 1), middle(1, 2), middle(2, 0)};
    add_triangle(camera, m, halvings - 1, sum);
    add_triangle(camera, {corner[0], m[0], m[2]}, halvings - 1, sum);
    add_triangle(camera, {m[0], corner[1], m[1]}, halvings - 1, sum);
    add_triangle(camera, {m[2], m[1], corner[2]}, halvings - 1, sum);
    return;
  }
  const Vec3 a = on_film(camera, corner[0]);
  const double area =
      0.5 * (on_film(camera, corner[1]) - a).cross(on_film(camera, corner[2]) - a).norm();
  if (!(area > 0.0)) return;
  const Vec3 point = (nearness[0] * corner[0] + nearness[1] * corner[1] + nearness[2] * corner[2]) /
                     (nearness[0] + nearness[1] + nearness[2]);
  sum.area += area;
  sum.first_moment += area * point;
  sum.points.push_back(point);
  sum.areas.push_back(area);
}

/// A visible part as triangles about its first vertex, each cut in four.
void add_part(const Camera& camera, const Polygon& part, Sum& sum) {
  constexpr int kHalvings = 1;
  for (std::size_t k = 2; k < part.size(); ++k)
    add_triangle(camera, {part[0], part[k - 1], part[k]}, kHalvings, sum);
}

struct Candidate {
  std::uint32_t piece;
  Polygon inside;  // the part in the pyramid
  bool front;
};

std::vector<Candidate> pieces_in(const PatchMesh& mesh, const Scene& scene,
                                 const Pyramid& pyramid) {
  std::vector<Candidate> found;
  Polygon current, kept;
  for (std::uint32_t p = 0; p < mesh.pieces.size(); ++p) {
    const Piece& piece = mesh.pieces[p];
    if (scene.surfaces[piece.surface].is_opening) continue;
    current = piece.polygon;
    const double tolerance = 1e-12 * piece.diameter_m;
    for (const Plane& side : pyramid.sides) {
      clip(current, side, tolerance, kept);
      current.swap(kept);
      if (current.empty()) break;
    }
    if (current.empty()) continue;
    found.push_back({p, current, piece.plane.distance_m(pyramid.apex) > 0.0});
  }
  return found;
}

void add_rectangle(const PatchMesh& mesh, const Scene& scene, const Camera& camera,
                   const Pyramid& pyramid, std::map<std::uint32_t, Sum>& sums) {
  const auto inside = pieces_in(mesh, scene, pyramid);
  std::vector<Blocker> blockers;
  for (const Candidate& c : inside) blockers.push_back({c.inside, mesh.pieces[c.piece].plane});
  VisibleParts visible;
  for (std::size_t i = 0; i < inside.size(); ++i) {
    if (!inside[i].front) continue;
    std::vector<const Blocker*> others;
    for (std::size_t k = 0; k < inside.size(); ++k)
      if (k != i) others.push_back(&blockers[k]);
    const Plane& plane = mesh.pieces[inside[i].piece].plane;
    for (const Polygon& part : visible(pyramid.apex, inside[i].inside, plane, others))
      add_part(camera, part, sums[inside[i].piece]);
  }
}

}  // namespace

std::vector<PixelBlock> seen_pieces(const PatchMesh& mesh, const Scene& scene, const Camera& camera,
                                    const PixelWindow& window) {
  std::map<std::uint32_t, Sum> sums;
  double film_area = 0.0;
  Vec3 eye = Vec3::Zero();
  for (const PixelRectangle& rectangle : window.mixed)
    if (const auto pyramid = pyramid_of(camera, rectangle)) {
      film_area += pyramid->film_area;
      eye = pyramid->apex;
      add_rectangle(mesh, scene, camera, *pyramid, sums);
    }
  std::vector<PixelBlock> blocks;
  for (auto& [piece, sum] : sums) {
    if (!(sum.area > 0.0)) continue;
    PixelBlock block;
    block.piece = piece;
    block.share = sum.area / film_area;
    block.points = std::move(sum.points);
    for (const double area : sum.areas) block.weights.push_back(area / sum.area);
    block.centre = sum.first_moment / sum.area;
    blocks.push_back(std::move(block));
  }
  // The largest comes first: the reading counts as its surface's.
  std::stable_sort(blocks.begin(), blocks.end(),
                   [](const PixelBlock& a, const PixelBlock& b) { return a.share > b.share; });
  return blocks;
}

}  // namespace truebox

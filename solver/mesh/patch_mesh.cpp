// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/patch_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "mesh/graded_mesh.h"

namespace truebox {
namespace {

struct Subdivision {
  double edge_m;
  int level;
  double power = 1.0;       // of the grading
  const Scene* scene = {};  // whose surfaces grade the edges they meet

  int cells_along(double length_m) const {
    return std::max(1, static_cast<int>(std::lround(length_m / edge_m))) << level;
  }
};

// Whether another surface, not in the same plane, reaches the middle of an edge.
bool meets_another(const Vec3& a, const Vec3& b, const Plane& plane, const Scene& scene) {
  const Vec3 middle = 0.5 * (a + b);
  for (const Surface& surface : scene.surfaces) {
    if (surface.is_opening) continue;
    for (const Polygon& other : surface.pieces) {
      const Plane face = plane_of(other);
      const double tolerance = 1e-7 * diameter_m(other);
      if (face.normal.cross(plane.normal).norm() < 1e-9) continue;
      bool inside = std::abs(face.distance_m(middle)) < tolerance;
      for (std::size_t i = 0; i < other.size() && inside; ++i) {
        const Vec3 along = (other[(i + 1) % other.size()] - other[i]).normalized();
        inside = face.normal.cross(along).dot(middle - other[i]) > -tolerance;
      }
      if (inside) return true;
    }
  }
  return false;
}

// n + 1 positions in [0, 1], like t^power from each graded end.
std::vector<double> graded_positions(int n, double power, bool low, bool high) {
  std::vector<double> positions;
  for (int i = 0; i <= n; ++i) {
    const double t = static_cast<double>(i) / n;
    positions.push_back(low && high && t <= 0.5 ? 0.5 * std::pow(2.0 * t, power)
                        : low && high           ? 1.0 - 0.5 * std::pow(2.0 * (1.0 - t), power)
                        : low                   ? std::pow(t, power)
                        : high                  ? 1.0 - std::pow(1.0 - t, power)
                                                : t);
  }
  return positions;
}

void grid_of_quad(const Polygon& q, const Subdivision& cut, std::vector<Polygon>& cells) {
  const int nu = cut.cells_along(std::max((q[1] - q[0]).norm(), (q[2] - q[3]).norm()));
  const int nv = cut.cells_along(std::max((q[3] - q[0]).norm(), (q[2] - q[1]).norm()));
  std::array<bool, 4> graded{};
  if (cut.power != 1.0)
    for (std::size_t k = 0; k < 4; ++k)
      graded[k] = meets_another(q[k], q[(k + 1) % 4], plane_of(q), *cut.scene);
  const auto us = graded_positions(nu, cut.power, graded[3], graded[1]);
  const auto vs = graded_positions(nv, cut.power, graded[0], graded[2]);
  const auto at = [&](int i, int j) -> Vec3 {
    const double u = us[static_cast<std::size_t>(i)], v = vs[static_cast<std::size_t>(j)];
    return (1 - v) * ((1 - u) * q[0] + u * q[1]) + v * ((1 - u) * q[3] + u * q[2]);
  };
  for (int j = 0; j < nv; ++j)
    for (int i = 0; i < nu; ++i)
      cells.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
}

void grid_of_triangle(const Polygon& t, const Subdivision& cut, std::vector<Polygon>& cells) {
  const double longest =
      std::max({(t[1] - t[0]).norm(), (t[2] - t[1]).norm(), (t[0] - t[2]).norm()});
  const int n = cut.cells_along(longest / std::sqrt(2.0));
  const auto at = [&](int i, int j) -> Vec3 {
    const double u = static_cast<double>(i) / n, v = static_cast<double>(j) / n;
    return (1 - u - v) * t[0] + u * t[1] + v * t[2];
  };
  for (int j = 0; j < n; ++j)
    for (int i = 0; i + j < n; ++i) {
      cells.push_back({at(i, j), at(i + 1, j), at(i, j + 1)});
      if (i + j + 1 < n) cells.push_back({at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
    }
}

std::vector<Polygon> cells_of(const Polygon& piece, const Subdivision& cut) {
  std::vector<Polygon> cells;
  if (piece.size() == 4) {
    grid_of_quad(piece, cut, cells);
  } else {
    for (std::size_t i = 2; i < piece.size(); ++i)
      grid_of_triangle({piece[0], piece[i - 1], piece[i]}, cut, cells);
  }
  return cells;
}

// Vertices of one piece, found again within a small tolerance.
class VertexPool {
 public:
  VertexPool(std::vector<Vec3>& vertices, const Piece& piece)
      : vertices_(vertices), origin_(piece.polygon[0]), step_m_(1e-8 * piece.diameter_m) {}

  std::uint32_t find_or_add(const Vec3& v) {
    std::array<long long, 3> key{};
    for (int k = 0; k < 3; ++k) key[k] = std::llround((v[k] - origin_[k]) / (4.0 * step_m_));
    // A coordinate on a rounding border may land in the next bin: look there too.
    for (int d = 0; d < 27; ++d) {
      const std::array<long long, 3> near = {key[0] + d % 3 - 1, key[1] + d / 3 % 3 - 1,
                                             key[2] + d / 9 - 1};
      const auto found = bins_.find(near);
      if (found != bins_.end() && (vertices_[found->second] - v).norm() < 2.0 * step_m_)
        return found->second;
    }
    vertices_.push_back(v);
    const auto index = static_cast<std::uint32_t>(vertices_.size() - 1);
    bins_[key] = index;
    return index;
  }

 private:
  std::vector<Vec3>& vertices_;
  Vec3 origin_;
  double step_m_;
  std::map<std::array<long long, 3>, std::uint32_t> bins_;
};

void add_piece(PatchMesh& mesh, const Scene& scene, std::size_t surface, const Polygon& polygon,
               const Subdivision& cut) {
  Piece piece{surface,
              polygon,
              plane_of(polygon),
              diameter_m(polygon),
              static_cast<std::uint32_t>(mesh.patches.size()),
              0,
              contact_lines(polygon, scene)};
  VertexPool pool(mesh.vertices, piece);
  for (const Polygon& cell :
       cut_along(cells_of(polygon, cut), piece.contacts, piece.plane.normal)) {
    Patch patch;
    patch.first_corner = static_cast<std::uint32_t>(mesh.corners.size());
    for (const Vec3& v : cell) {
      const std::uint32_t index = pool.find_or_add(v);
      if (mesh.corners.size() == patch.first_corner || mesh.corners.back() != index)
        mesh.corners.push_back(index);
    }
    patch.corner_count = static_cast<std::uint32_t>(mesh.corners.size()) - patch.first_corner;
    patch.piece = static_cast<std::uint32_t>(mesh.pieces.size());
    patch.centroid = centroid(cell);
    patch.area_m2 = area_vector(cell).norm();
    mesh.patches.push_back(patch);
  }
  piece.patch_count = static_cast<std::uint32_t>(mesh.patches.size()) - piece.first_patch;
  mesh.pieces.push_back(std::move(piece));
}

}  // namespace

void PatchMesh::polygon_of(const Patch& patch, Polygon& polygon) const {
  polygon.clear();
  for (std::uint32_t corner : corners_of(patch)) polygon.push_back(vertices[corner]);
}

PatchMesh uniform_mesh(const Scene& scene, double edge_m, int level) {
  return graded_mesh(scene, edge_m, 1.0, level);
}

PatchMesh graded_mesh(const Scene& scene, double edge_m, double power, int level) {
  PatchMesh mesh;
  for (std::size_t s = 0; s < scene.surfaces.size(); ++s) {
    const Surface& surface = scene.surfaces[s];
    const Subdivision cut{surface.is_opening ? 2.0 * edge_m : edge_m, level, power, &scene};
    for (const Polygon& polygon : surface.pieces) add_piece(mesh, scene, s, polygon, cut);
  }
  return mesh;
}

double edge_for_count(const Scene& scene, std::size_t count) {
  double area = 0.0;
  for (const Surface& surface : scene.surfaces)
    for (const Polygon& piece : surface.pieces) area += area_vector(piece).norm();
  return std::sqrt(area / static_cast<double>(std::max<std::size_t>(count, 1)));
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/patch_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "mesh/add_piece.h"
#include "mesh/graded_mesh.h"
#include "mesh/uniform_cells.h"

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

void grid_of_triangle(const Polygon& t, int n, std::vector<Polygon>& cells) {
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
    // As many along each edge of the fan: its triangles share their vertices.
    double longest = 0.0;
    for (std::size_t i = 2; i < piece.size(); ++i)
      longest = std::max({longest, (piece[i - 1] - piece[0]).norm(),
                          (piece[i] - piece[i - 1]).norm(), (piece[0] - piece[i]).norm()});
    const int n = cut.cells_along(longest / std::sqrt(2.0));
    for (std::size_t i = 2; i < piece.size(); ++i)
      grid_of_triangle({piece[0], piece[i - 1], piece[i]}, n, cells);
  }
  return cells;
}

}  // namespace

void PatchMesh::polygon_of(const Patch& patch, Polygon& polygon) const {
  polygon.clear();
  for (std::uint32_t corner : corners_of(patch)) polygon.push_back(vertices[corner]);
}

std::vector<Polygon> uniform_cells(const Polygon& piece, double edge_m) {
  return cells_of(piece, {edge_m, 0});
}

PatchMesh uniform_mesh(const Scene& scene, double edge_m, int level) {
  return graded_mesh(scene, edge_m, 1.0, level);
}

PatchMesh graded_mesh(const Scene& scene, double edge_m, double power, int level) {
  PatchMesh mesh;
  for (std::size_t s = 0; s < scene.surfaces.size(); ++s) {
    const Surface& surface = scene.surfaces[s];
    const Subdivision cut{surface.is_opening ? 2.0 * edge_m : edge_m, level, power, &scene};
    for (const Polygon& polygon : surface.pieces) {
      const auto contacts = contact_lines(polygon, scene);
      const Vec3 normal = plane_of(polygon).normal;
      add_piece(mesh, s, polygon, contacts, cut_along(cells_of(polygon, cut), contacts, normal));
    }
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

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/contact_lines.h"
#include "scene/scene.h"

namespace truebox {

/// A flat convex element of a surface.
struct Patch {
  std::uint32_t first_corner = 0;  ///< into PatchMesh::corners
  std::uint32_t corner_count = 0;
  std::uint32_t piece = 0;  ///< into PatchMesh::pieces
  Vec3 centroid = Vec3::Zero();
  double area_m2 = 0.0;
};

/// A planar convex piece of a scene surface, carrying its patches.
struct Piece {
  std::size_t surface = 0;  ///< into Scene::surfaces
  Polygon polygon;
  Plane plane;
  double diameter_m = 0.0;
  std::uint32_t first_patch = 0;
  std::uint32_t patch_count = 0;
  std::vector<ContactLine> contacts;  ///< where other surfaces touch: radiosity may jump across
};

/// Elements of all surfaces. Vertices are shared within a piece, never between pieces: radiosity
/// may jump across an edge of the scene.
struct PatchMesh {
  std::vector<Vec3> vertices;
  std::vector<std::uint32_t> corners;
  std::vector<Patch> patches;
  std::vector<Piece> pieces;

  std::size_t size() const { return patches.size(); }
  /// Copies the corners of a patch into `polygon`.
  void polygon_of(const Patch& patch, Polygon& polygon) const;
  std::span<const std::uint32_t> corners_of(const Patch& patch) const {
    return {corners.data() + patch.first_corner, patch.corner_count};
  }
  const Plane& plane_of(const Patch& patch) const { return pieces[patch.piece].plane; }
  std::size_t surface_of(const Patch& patch) const { return pieces[patch.piece].surface; }
};

/// Cuts every surface into elements: bilinear grids on quads, similar triangles on triangles, a fan
/// of triangles otherwise, with edges of about `edge_m` / 2^level; the next level cuts each element
/// of this one in four. Elements crossed by a line where another surface touches are cut along it,
/// so that no element lies half under a block. Openings get elements twice as long.
PatchMesh uniform_mesh(const Scene& scene, double edge_m, int level = 0);

/// The edge (m) that gives about `count` elements at level 0.
double edge_for_count(const Scene& scene, std::size_t count);

}  // namespace truebox

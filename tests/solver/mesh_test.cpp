// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include "mesh/contact_lines.h"
#include "mesh/patch_mesh.h"
#include "scene/scene_file.h"
#include "support/tiny_scenes.h"

namespace truebox {
namespace {

constexpr double kAreaRounding = 1e-12;  // relative: sums of hundreds of elements

Scene cornell_box() {
  return read_scene(std::string(TRUEBOX_REFERENCE_DIR) + "/cornell_box/cornell_box.toml");
}

bool holds(const Polygon& polygon, const Vec3& normal, const Vec3& point, double tolerance) {
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vec3& a = polygon[k];
    const Vec3 inward = normal.cross(polygon[(k + 1) % polygon.size()] - a).normalized();
    if (inward.dot(point - a) < -tolerance) return false;
  }
  return true;
}

class Mesh : public testing::TestWithParam<double> {};

TEST_P(Mesh, ConservesTheAreaOfEveryPiece) {
  const Scene scene = cornell_box();
  for (int level : {0, 1}) {
    const PatchMesh mesh = uniform_mesh(scene, GetParam(), level);
    for (const Piece& piece : mesh.pieces) {
      double sum = 0.0;
      for (std::uint32_t p = piece.first_patch; p < piece.first_patch + piece.patch_count; ++p)
        sum += mesh.patches[p].area_m2;
      EXPECT_NEAR(sum / area_vector(piece.polygon).norm(), 1.0, kAreaRounding)
          << scene.surfaces[piece.surface].name;
    }
  }
}

TEST_P(Mesh, NextLevelNestsInThisOne) {
  const Scene scene = cornell_box();
  const PatchMesh coarse = uniform_mesh(scene, GetParam(), 0),
                  fine = uniform_mesh(scene, GetParam(), 1);
  EXPECT_GT(fine.size(), 3 * coarse.size());
  ASSERT_EQ(fine.pieces.size(), coarse.pieces.size());
  // Where a contact line ends inside a coarse element, its cut runs on to the element's edge; the
  // fine elements there are not cut, and straddle it. Two blocks have eight such ends.
  std::size_t straddling = 0;
  constexpr std::size_t kAtLineEnds = 2 * 8;
  Polygon child, parent;
  for (const Patch& patch : fine.patches) {
    fine.polygon_of(patch, child);
    const Piece& piece = coarse.pieces[patch.piece];
    bool nests = false;
    for (std::uint32_t p = piece.first_patch; p < piece.first_patch + piece.patch_count; ++p) {
      coarse.polygon_of(coarse.patches[p], parent);
      if (!holds(parent, piece.plane.normal, patch.centroid, 0.0)) continue;
      nests = true;
      for (const Vec3& v : child)
        nests &= holds(parent, piece.plane.normal, v, 1e-6 * piece.diameter_m);
      if (nests) break;
    }
    if (contact_lines(piece.polygon, scene).empty()) {
      EXPECT_TRUE(nests) << scene.surfaces[piece.surface].name << " at "
                         << patch.centroid.transpose();
    }
    straddling += !nests;
  }
  EXPECT_LE(straddling, kAtLineEnds);
}

TEST_P(Mesh, ElementsKeepTheirSideAndShape) {
  const PatchMesh mesh = uniform_mesh(cornell_box(), GetParam());
  Polygon polygon;
  for (const Patch& patch : mesh.patches) {
    mesh.polygon_of(patch, polygon);
    ASSERT_GE(polygon.size(), 3u);
    EXPECT_GT(area_vector(polygon).dot(mesh.plane_of(patch).normal), 0.0);
    EXPECT_TRUE(is_convex(polygon, 1e-6 * diameter_m(polygon)));
  }
}

INSTANTIATE_TEST_SUITE_P(Edges, Mesh, testing::Values(0.2, 0.07), [](const auto& edge) {
  return "mm" + std::to_string(int(1e3 * edge.param));
});

TEST(Mesh, NoElementStraddlesTheFootprintOfABlock) {
  const Scene scene = tiny::cube_with_block(1.0, 0.5);
  // The block's footprint on the floor: [0.31, 0.58] x [0.37, 0.66].
  const double x0 = 0.31, x1 = 0.58, y0 = 0.37, y1 = 0.66, slack = 1e-6;
  const PatchMesh mesh = uniform_mesh(scene, 0.13);
  Polygon polygon;
  int under = 0;
  for (const Patch& patch : mesh.patches) {
    if (mesh.surface_of(patch) != 0) continue;
    mesh.polygon_of(patch, polygon);
    const Vec3& c = patch.centroid;
    const bool inside = c.x() > x0 && c.x() < x1 && c.y() > y0 && c.y() < y1;
    under += inside;
    for (const Vec3& v : polygon) {
      const bool within =
          v.x() > x0 - slack && v.x() < x1 + slack && v.y() > y0 - slack && v.y() < y1 + slack;
      const bool strictly =
          v.x() > x0 + slack && v.x() < x1 - slack && v.y() > y0 + slack && v.y() < y1 - slack;
      EXPECT_TRUE(inside ? within : !strictly) << v.transpose() << " of " << c.transpose();
    }
  }
  EXPECT_GT(under, 0);
}

TEST(Mesh, HasAboutTheCountAskedFor) {
  const Scene cube = tiny::cube(1.0, 0.5);
  EXPECT_EQ(uniform_mesh(cube, edge_for_count(cube, 600)).size(), 600u);
  const Scene box = cornell_box();
  const auto count = uniform_mesh(box, edge_for_count(box, 1500)).size();
  EXPECT_GT(count, 1100u);
  EXPECT_LT(count, 1900u);
}

}  // namespace
}  // namespace truebox

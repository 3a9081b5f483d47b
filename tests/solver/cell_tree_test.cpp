// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/cell_tree.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "mesh/hanging_vertices.h"
#include "mesh/smooth_field.h"
#include "mesh/vertex_radiosity.h"
#include "support/cracks.h"
#include "support/tiny_scenes.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr double kRounding = 1e-11;

// A quad, a bent quad, a triangle and a pentagon, apart from each other.
Scene four_shapes() {
  Scene scene = tiny::grey_scene(0.5);
  tiny::add_surface(scene, "quad", {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
  tiny::add_surface(scene, "bent", {{0, 0, 1}, {1, 0.1, 1}, {0.8, 1, 1}, {-0.1, 0.7, 1}});
  tiny::add_surface(scene, "triangle", {{0, 0, 2}, {1, 0, 2}, {0.2, 0.9, 2}});
  tiny::add_surface(scene, "pentagon",
                    {{0, 0, 3}, {1, 0, 3}, {1.2, 0.6, 3}, {0.5, 1, 3}, {-0.1, 0.6, 3}});
  return scene;
}

CellTree halved_at_random(const Scene& scene, int times, unsigned seed) {
  CellTree cells(scene, 0.25);
  std::mt19937_64 random(seed);
  for (int time = 0; time < times; ++time) {
    const std::size_t i = random() % cells.size();
    const Polygon& p = cells.cell(i).corners;
    int direction = static_cast<int>(random() % (p.size() == 4 ? 2 : 3));
    // Four times as long as wide is enough: beyond, quadratics have too few neighbours across.
    if (p.size() == 4) {
      const double u = (p[1] - p[0]).norm(), v = (p[3] - p[0]).norm();
      if (u > 2.5 * v) direction = 0;
      if (v > 2.5 * u) direction = 1;
    } else {
      for (int k = 0; k < 3; ++k)
        if ((p[(k + 1) % 3] - p[k]).norm() > (p[(direction + 1) % 3] - p[direction]).norm())
          direction = k;
    }
    cells.halve(i, direction);
  }
  return cells;
}

double area_of_surface(const PatchMesh& mesh, std::size_t surface) {
  double sum = 0.0;
  for (const Patch& patch : mesh.patches)
    if (mesh.surface_of(patch) == surface) sum += patch.area_m2;
  return sum;
}

BandMatrix random_means(const PatchMesh& mesh, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> value(1.0, 2.0);
  BandMatrix means(static_cast<Index>(mesh.size()), 1);
  for (Index i = 0; i < means.rows(); ++i) means(i, 0) = value(random);
  return means;
}

TEST(CellTree, KeepsEverySurfacesAreaHoweverItIsHalved) {
  const Scene scene = four_shapes();
  const PatchMesh uniform = uniform_mesh(scene, 0.25);
  const CellTree cells = halved_at_random(scene, 300, 3);
  for (int level : {0, 1, 2}) {
    std::vector<std::uint32_t> cell_of;
    const PatchMesh mesh = cells.mesh(level, &cell_of);
    ASSERT_EQ(mesh.size(), cells.size() << (2 * level));
    ASSERT_EQ(cell_of.size(), mesh.size());
    for (std::size_t s = 0; s < scene.surfaces.size(); ++s)
      EXPECT_NEAR(area_of_surface(mesh, s), area_of_surface(uniform, s), kRounding);
    std::vector<double> area(cells.size(), 0.0);
    for (std::size_t i = 0; i < mesh.size(); ++i) area[cell_of[i]] += mesh.patches[i].area_m2;
    for (std::size_t c = 0; c < cells.size(); ++c)
      EXPECT_NEAR(area[c], area_vector(cells.cell(c).corners).norm(), kRounding);
  }
}

TEST(CellTree, FindsHangingVerticesWhereOneCellWasHalved) {
  Scene scene = tiny::grey_scene(0.5);
  tiny::add_surface(scene, "quad", {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
  CellTree cells(scene, 0.5);
  ASSERT_EQ(cells.size(), 4u);
  EXPECT_TRUE(hanging_vertices(cells.mesh(1)).empty());
  cells.halve(0, 0);  // its two halves meet at the middle of the next cell's edge, and of the rim
  const PatchMesh mesh = cells.mesh(0);
  const auto hanging = hanging_vertices(mesh);
  ASSERT_EQ(hanging.size(), 1u);
  EXPECT_NEAR(hanging[0].share, 0.5, kRounding);
  EXPECT_NEAR((mesh.vertices[hanging[0].vertex] - Vec3(0.25, 0.5, 0)).norm(), 0.0, kRounding);
}

// Corners of a mesh on a piece, along x.
std::vector<double> widths_along_x(const CellTree& cells, std::uint32_t piece) {
  std::vector<double> x;
  const PatchMesh mesh = cells.mesh(0);
  for (const Patch& patch : mesh.patches)
    if (patch.piece == piece)
      for (std::uint32_t v : mesh.corners_of(patch)) x.push_back(mesh.vertices[v].x());
  std::sort(x.begin(), x.end());
  x.erase(std::unique(x.begin(), x.end(), [](double a, double b) { return b - a < kRounding; }),
          x.end());
  return x;
}

TEST(CellTree, CutsAtAQuarterFromWhereSurfacesMeetAndInTheMiddleElsewhere) {
  Scene scene = tiny::grey_scene(0.5);
  tiny::add_surface(scene, "floor", {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
  tiny::add_surface(scene, "wall", {{0, 0, 0}, {0, 1, 0}, {0, 1, 1}, {0, 0, 1}});  // faces +x
  CellTree cells(scene, 1.0);
  ASSERT_EQ(cells.size(), 2u);
  cells.halve(0, 0);
  EXPECT_THAT(widths_along_x(cells, 0),
              testing::Pointwise(testing::DoubleNear(kRounding), {0.0, 0.25, 1.0}));
  const CellTree once = cells;
  cells.halve(0, 0);  // the part at the wall
  EXPECT_THAT(widths_along_x(cells, 0),
              testing::Pointwise(testing::DoubleNear(kRounding), {0.0, 0.0625, 0.25, 1.0}));
  cells = once;
  cells.halve(2, 0);  // the part that touches nothing
  EXPECT_THAT(widths_along_x(cells, 0),
              testing::Pointwise(testing::DoubleNear(kRounding), {0.0, 0.25, 0.625, 1.0}));
}

TEST(CellTree, LeavesNoCracksInTheFieldsOfRandomRefinement) {
  const Scene scene = four_shapes();
  for (unsigned seed : {1u, 2u, 3u}) {
    const PatchMesh mesh = halved_at_random(scene, 150, seed).mesh(0);
    ASSERT_GT(hanging_vertices(mesh).size(), 25u);
    const std::vector<char> usable(mesh.size(), 1);
    const BandMatrix means = random_means(mesh, seed);
    std::size_t edges = 0;
    // Means are random: quadratics reach a hundred times as high, and Wachspress coordinates keep
    // 1e-9 of an element's size away from its edges.
    EXPECT_LT(worst_crack(mesh, SmoothField(mesh, usable, means), edges), 1e-5);
    EXPECT_GT(edges, mesh.size());
    for (VertexRule rule : {VertexRule::averaged, VertexRule::least_squares})
      EXPECT_LT(worst_crack(mesh, VertexRadiosity(mesh, usable, means, rule), edges), 1e-5);
  }
}

TEST(CellTree, LeavesNoCracksWhereALineOfContactEndsInsideAnElement) {
  const Scene scene = tiny::cube_with_block(1.0, 0.5);
  const PatchMesh mesh = uniform_mesh(scene, 0.25);
  ASSERT_FALSE(hanging_vertices(mesh).empty());  // the lines cut whole elements, neighbours not
  const std::vector<char> usable(mesh.size(), 1);
  const BandMatrix means = random_means(mesh, 4);
  std::size_t edges = 0;
  EXPECT_LT(worst_crack(mesh, SmoothField(mesh, usable, means), edges), 1e-5);
  EXPECT_GT(edges, mesh.size());
}

TEST(CellTree, FieldsOfAHalvedMeshStillReproduceAPlane) {
  const Scene scene = four_shapes();
  const PatchMesh mesh = halved_at_random(scene, 200, 9).mesh(0);
  BandMatrix means(static_cast<Index>(mesh.size()), 1);
  const auto plane = [](const Vec3& x) { return 5.0 + 2.0 * x.x() - x.y(); };
  for (std::size_t i = 0; i < mesh.size(); ++i)
    means(static_cast<Index>(i), 0) = plane(mesh.patches[i].centroid);
  const SmoothField field(mesh, std::vector<char>(mesh.size(), 1), means);
  Eigen::VectorXd value(1);
  for (std::uint32_t i = 0; i < mesh.size(); ++i)
    for (std::uint32_t v : mesh.corners_of(mesh.patches[i])) {
      const Vec3 x = mesh.patches[i].centroid + 0.9 * (mesh.vertices[v] - mesh.patches[i].centroid);
      field.evaluate(i, x, value);
      EXPECT_NEAR(value[0], plane(x), 1e-8);  // least squares over elements of very different size
    }
}

}  // namespace
}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/vertex_radiosity.h"

#include <gmock/gmock.h>

#include "mesh/graded_mesh.h"
#include "support/tiny_scenes.h"

namespace truebox {
namespace {

using Eigen::Index;

double linear(const Vec3& x) { return 3.0 + x.x() - 2.0 * x.y() + 0.5 * x.z(); }

// Means of a linear function: its values at the centroids.
BandMatrix linear_means(const PatchMesh& mesh) {
  BandMatrix means(static_cast<Index>(mesh.size()), 1);
  for (std::size_t i = 0; i < mesh.size(); ++i)
    means(static_cast<Index>(i), 0) = linear(mesh.patches[i].centroid);
  return means;
}

double worst_error(const PatchMesh& mesh, const VertexRadiosity& field) {
  double worst = 0.0;
  Eigen::VectorXd value(1);
  for (std::uint32_t p = 0; p < mesh.size(); ++p) {
    const auto corners = mesh.corners_of(mesh.patches[p]);
    const Vec3 x = 0.7 * mesh.vertices[corners[0]] + 0.3 * mesh.patches[p].centroid;
    field.evaluate(p, x, value);
    worst = std::max(worst, std::abs(value[0] - linear(x)));
    for (std::size_t k = 0; k < corners.size(); ++k)
      worst =
          std::max(worst, std::abs(field.at_corner(p, k)[0] - linear(mesh.vertices[corners[k]])));
  }
  return worst;
}

TEST(VertexRadiosity, ReproducesLinearRadiosity) {
  const Scene cube = tiny::cube(1.0, 0.5);
  const PatchMesh uniform = uniform_mesh(cube, 0.25), graded = graded_mesh(cube, 0.2, 2.0);
  const auto field = [](const PatchMesh& mesh, VertexRule rule) {
    return VertexRadiosity(mesh, std::vector<char>(mesh.size(), 1), linear_means(mesh), rule);
  };
  constexpr double kRounding = 1e-12;
  EXPECT_LT(worst_error(uniform, field(uniform, VertexRule::averaged)), kRounding);
  EXPECT_LT(worst_error(uniform, field(uniform, VertexRule::least_squares)), kRounding);
  EXPECT_LT(worst_error(graded, field(graded, VertexRule::least_squares)), kRounding);
  // The mean of unequal elements is not the value at their common vertex.
  EXPECT_GT(worst_error(graded, field(graded, VertexRule::averaged)), 0.01);
}

TEST(VertexRadiosity, FollowsTheRuleOfCohenAndGreenberg) {
  // 3 x 3 elements on a square: B_e = mean of four, edges and corners by extrapolation.
  Scene scene = tiny::grey_scene(0.5);
  tiny::add_surface(scene, "square", {{0, 0, 0}, {3, 0, 0}, {3, 3, 0}, {0, 3, 0}});
  const PatchMesh mesh = uniform_mesh(scene, 1.0);
  ASSERT_EQ(mesh.size(), 9u);
  BandMatrix means(9, 1);
  means << 1, 2, 4, 8, 16, 32, 64, 128, 256;  // row by row in y
  const VertexRadiosity field(mesh, std::vector<char>(9, 1), means, VertexRule::averaged);
  // Corners of element 0: (0, 0), (1, 0), (1, 1), (0, 1).
  const double inside = (1 + 2 + 8 + 16) / 4.0;
  EXPECT_DOUBLE_EQ(field.at_corner(0, 2)[0], inside);
  EXPECT_DOUBLE_EQ(field.at_corner(0, 1)[0], 1 + 2 - inside);
  EXPECT_DOUBLE_EQ(field.at_corner(0, 3)[0], 1 + 8 - inside);
  EXPECT_DOUBLE_EQ(field.at_corner(0, 0)[0], 2 * 1 - inside);
}

TEST(VertexRadiosity, KeepsTheJumpUnderABlock) {
  // The floor is 1, what the block buries is 0 and not usable: no dark leaks out.
  const Scene scene = tiny::cube_with_block(1.0, 0.5);
  const PatchMesh mesh = uniform_mesh(scene, 0.1);
  const auto buried = [](const Vec3& x) {
    return x.x() > 0.31 && x.x() < 0.58 && x.y() > 0.37 && x.y() < 0.66;
  };
  BandMatrix means = BandMatrix::Ones(static_cast<Index>(mesh.size()), 1);
  std::vector<char> usable(mesh.size(), 1);
  for (std::size_t i = 0; i < mesh.size(); ++i)
    if (mesh.surface_of(mesh.patches[i]) == 0 && buried(mesh.patches[i].centroid))
      means(static_cast<Index>(i), 0) = 0.0, usable[i] = 0;
  ASSERT_LT(means.minCoeff(), 0.5);
  for (const VertexRule rule : {VertexRule::averaged, VertexRule::least_squares}) {
    const VertexRadiosity field(mesh, usable, means, rule);
    for (std::uint32_t p = 0; p < mesh.size(); ++p)
      for (std::size_t k = 0; usable[p] && k < mesh.patches[p].corner_count; ++k)
        EXPECT_NEAR(field.at_corner(p, k)[0], 1.0, 1e-12) << p;
  }
}

TEST(VertexRadiosity, AveragesWhereThereIsNothingToExtrapolateFrom) {
  Scene scene = tiny::grey_scene(0.5);
  tiny::add_surface(scene, "square", {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
  const PatchMesh mesh = uniform_mesh(scene, 1.0);
  for (const VertexRule rule : {VertexRule::averaged, VertexRule::least_squares})
    EXPECT_EQ(VertexRadiosity(mesh, {1}, BandMatrix::Constant(1, 2, 7.0), rule).at_corner(0, 2)[1],
              7.0);
}

}  // namespace
}  // namespace truebox

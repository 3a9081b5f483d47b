// SPDX-License-Identifier: BSD-3-Clause
#include "discontinuity/discontinuity_lines.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "support/penumbra_scene.h"

namespace truebox {
namespace {

constexpr double kWidth_m = 0.2;
constexpr double kRounding_m = 1e-12;

std::vector<DiscontinuityLine> lines_on(const Scene& scene, std::uint32_t piece,
                                        double least_strength = 1e-6) {
  const PatchMesh mesh = uniform_mesh(scene, scene.diameter_m());
  const Gather gather(mesh, scene, true);
  const ShaftCulling culling(mesh, scene, true);
  return discontinuity_lines(scene, mesh, piece, gather, culling, {kWidth_m, 1.0, least_strength});
}

bool is_along_x_at(const DiscontinuityLine& line, Eigen::Index axis, double at_m) {
  return std::abs(line.from[axis] - at_m) < kRounding_m &&
         std::abs(line.to[axis] - at_m) < kRounding_m;
}

TEST(DiscontinuityLines, LieWhereTheUmbraAndPenumbraOfASquareEnd) {
  const tiny::PenumbraScene shadow;
  const auto lines = lines_on(shadow.scene(), 0);
  for (const Eigen::Index axis : {0, 1})
    for (const double side : {-1.0, 1.0})
      for (const double at_m : {shadow.umbra_m(), shadow.penumbra_m()})
        EXPECT_TRUE(std::any_of(lines.begin(), lines.end(),
                                [&](const DiscontinuityLine& line) {
                                  return line.order == 1 && is_along_x_at(line, axis, side * at_m);
                                }))
            << "axis " << axis << " at " << side * at_m;
  for (const DiscontinuityLine& line : lines) {  // and nowhere else
    const bool is_known = std::any_of(lines.begin(), lines.end(), [&](const DiscontinuityLine&) {
      for (const Eigen::Index axis : {0, 1})
        for (const double side : {-1.0, 1.0})
          for (const double at_m : {shadow.umbra_m(), shadow.penumbra_m()})
            if (is_along_x_at(line, axis, side * at_m)) return true;
      return false;
    });
    EXPECT_TRUE(is_known) << line.from.transpose() << " to " << line.to.transpose();
    EXPECT_EQ(line.order, 1);
  }
}

double distance_from_plane(const Vec3& x, const Vec3& a, const Vec3& b, const Vec3& c) {
  return std::abs((b - a).cross(c - a).normalized().dot(x - a));
}

TEST(DiscontinuityLines, LieInPlanesOfACornerAndAnEdgeWhereNothingIsParallel) {
  tiny::PenumbraScene shadow;
  shadow.turn_rad = 0.4;
  const auto lines = lines_on(shadow.scene(), 0);
  EXPECT_GE(lines.size(), 16u);  // each corner of the lamp past each edge of the blocker
  const Polygon lamp = shadow.lamp(), blocker = shadow.blocker();
  for (const DiscontinuityLine& line : lines) {
    EXPECT_EQ(line.order, 2);
    EXPECT_GT(line.strength, 0.0);
    double nearest_m = HUGE_VAL;
    for (std::size_t c = 0; c < 4; ++c)
      for (std::size_t e = 0; e < 4; ++e) {
        const auto off_m = [&](const Vec3& corner, const Polygon& edges) {
          const Vec3 &a = edges[e], &b = edges[(e + 1) % 4];
          return std::max(distance_from_plane(line.from, corner, a, b),
                          distance_from_plane(line.to, corner, a, b));
        };
        nearest_m = std::min({nearest_m, off_m(lamp[c], blocker), off_m(blocker[c], lamp)});
      }
    EXPECT_LT(nearest_m, kRounding_m);
  }
}

TEST(DiscontinuityLines, AreStrongerWhereTheSlopeJumpsThanWhereTheCurvatureDoes) {
  tiny::PenumbraScene parallel, turned;
  turned.turn_rad = 0.4;
  double slope = 0.0, curvature = 0.0;
  for (const auto& line : lines_on(parallel.scene(), 0)) slope = std::max(slope, line.strength);
  for (const auto& line : lines_on(turned.scene(), 0))
    curvature = std::max(curvature, line.strength);
  EXPECT_GT(slope, curvature);
}

TEST(DiscontinuityLines, OfABlockerInTheDeepShadeOfAnotherAreLeftOut) {
  const tiny::PenumbraScene shadow;
  Scene scene = shadow.scene();
  const auto before = lines_on(scene, 0);
  tiny::add_surface(scene, "hidden",
                    {{-0.1, -0.1, 0.3}, {0.1, -0.1, 0.3}, {0.1, 0.1, 0.3}, {-0.1, 0.1, 0.3}});
  EXPECT_EQ(lines_on(scene, 0).size(), before.size());
}

TEST(DiscontinuityLines, RunWhereALampIsSeenEdgeOn) {
  Scene scene = tiny::grey_scene(0.5);
  scene.materials.push_back({"lamp", Reflectance(1, 0.0), RadiantExitance(1, 1.0)});
  tiny::add_surface(scene, "floor", {{-2, -2, 0}, {2, -2, 0}, {2, 2, 0}, {-2, 2, 0}});
  tiny::add_surface(scene, "lamp",
                    {{0.3, -0.2, 0.5}, {0.3, 0.2, 0.5}, {0.3, 0.2, 0.9}, {0.3, -0.2, 0.9}}, 1);
  const auto lines = lines_on(scene, 0);
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_EQ(lines[0].order, 1);
  EXPECT_TRUE(is_along_x_at(lines[0], 0, 0.3));
}

TEST(DiscontinuityLines, AreNoneOfALampBehindTheReceiver) {
  tiny::PenumbraScene shadow;
  Scene scene = shadow.scene();
  Polygon& lamp = scene.surfaces[1].pieces[0];
  for (Vec3& v : lamp) v.z() = -1.0;
  EXPECT_TRUE(lines_on(scene, 0).empty());
}

TEST(DiscontinuityLines, OfABlockerThatHangsFromTheLampAreFinite) {
  Scene scene = tiny::grey_scene(0.5);
  scene.materials.push_back({"lamp", Reflectance(1, 0.0), RadiantExitance(1, 1.0)});
  const tiny::PenumbraScene shadow;
  tiny::add_surface(scene, "floor", {{-2, -2, 0}, {2, -2, 0}, {2, 2, 0}, {-2, 2, 0}});
  tiny::add_surface(scene, "lamp", shadow.lamp(), 1);
  const double edge_m = shadow.lamp_m, top_m = shadow.height_m;
  tiny::add_surface(
      scene, "curtain",
      {{edge_m, -0.5, top_m}, {edge_m, -0.5, 1.0}, {edge_m, 0.5, 1.0}, {edge_m, 0.5, top_m}});
  const auto lines = lines_on(scene, 0);
  EXPECT_FALSE(lines.empty());
  for (const DiscontinuityLine& line : lines) {
    EXPECT_TRUE(line.from.allFinite() && line.to.allFinite());
    EXPECT_NEAR(line.from.z(), 0.0, kRounding_m);
    EXPECT_LE(line.from.cwiseAbs().maxCoeff(), 2.0 + 1e-9);
  }
}

TEST(DiscontinuityLines, HoldEveryLineOfContact) {
  Scene scene = tiny::cube_with_block(1.0, 0.5);
  scene.materials.push_back({"lamp", Reflectance(1, 0.5), RadiantExitance(1, 1.0)});
  scene.surfaces[1].material = 1;
  const auto lines = lines_on(scene, 0);
  const auto contacts =
      std::count_if(lines.begin(), lines.end(), [](const auto& line) { return line.order == 0; });
  EXPECT_GE(contacts, 4);
}

}  // namespace
}  // namespace truebox

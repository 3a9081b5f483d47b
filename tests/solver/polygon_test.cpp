// SPDX-License-Identifier: BSD-3-Clause
#include "scene/polygon.h"

#include <gmock/gmock.h>

namespace truebox {
namespace {

constexpr double kRounding = 1e-14;  // m and m^2 at unit size: a handful of operations

double total_area(const std::vector<Polygon>& pieces) {
  double sum = 0.0;
  for (const Polygon& p : pieces) sum += area_vector(p).norm();
  return sum;
}

void expect_convex_pieces(const std::vector<Polygon>& pieces, const Vec3& normal) {
  for (const Polygon& p : pieces) {
    EXPECT_TRUE(is_convex(p, 1e-9));
    EXPECT_NEAR(plane_of(p).normal.dot(normal), 1.0, kRounding) << "lost its lit side";
  }
}

const Polygon kSquare = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
const Polygon kHole = {{0.2, 0.3, 0}, {0.6, 0.3, 0}, {0.6, 0.8, 0}, {0.2, 0.8, 0}};
const Polygon kShapeL = {{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}, {1, 3, 0}, {0, 3, 0}};

TEST(Polygon, KeepsItsDigitsFarFromTheOrigin) {
  constexpr double kFar = 1e6, kEdge = 1e-3;
  Polygon p = kSquare;
  for (Vec3& v : p) v = kEdge * v + Vec3::Constant(kFar);
  // Coordinates are rounded at 1e6 * 1.1e-16 = 1.1e-10, 1e-7 of the edge.
  EXPECT_NEAR(area_vector(p).norm() / (kEdge * kEdge), 1.0, 5e-7);
  EXPECT_NEAR((centroid(p) - Vec3::Constant(kFar)).x(), 0.5 * kEdge, 1e-9);
}

TEST(ConvexPieces, LeaveAConvexPolygonWhole) {
  const auto pieces = convex_pieces(kSquare, {});
  ASSERT_EQ(pieces.size(), 1u);
  EXPECT_EQ(pieces[0].size(), 4u);
}

TEST(ConvexPieces, CoverAnL) {
  const auto pieces = convex_pieces(kShapeL, {});
  EXPECT_NEAR(total_area(pieces), 4.0, 4 * kRounding);
  expect_convex_pieces(pieces, Vec3::UnitZ());
}

TEST(ConvexPieces, GoRoundAHole) {
  for (const Polygon& hole : {kHole, Polygon(kHole.rbegin(), kHole.rend())}) {
    const auto pieces = convex_pieces(kSquare, {hole});
    EXPECT_NEAR(total_area(pieces), 1.0 - 0.4 * 0.5, kRounding);
    expect_convex_pieces(pieces, Vec3::UnitZ());
  }
}

TEST(ConvexPieces, GoRoundAnLShapedHole) {
  Polygon hole = kShapeL;
  for (Vec3& v : hole) v = 0.2 * v + Vec3(0.1, 0.1, 0.0);
  const auto pieces = convex_pieces(kSquare, {hole});
  EXPECT_NEAR(total_area(pieces), 1.0 - 4.0 * 0.04, 4 * kRounding);
  expect_convex_pieces(pieces, Vec3::UnitZ());
}

TEST(ConvexPieces, AreNoneOfASquareThatIsAllHole) {
  EXPECT_TRUE(convex_pieces(kSquare, {kSquare}).empty());
}

TEST(ConvexPieces, AreNoneOfAnOutlineThatCrossesItself) {
  EXPECT_TRUE(convex_pieces({{0, 0, 0}, {2, 0, 0}, {0, 1, 0}, {3, 2, 0}}, {}).empty()) << "bow tie";
  EXPECT_TRUE(convex_pieces({{0, 0, 0}, {4, 0, 0}, {4, 3, 0}, {1, 3, 0}, {3, -1, 0}, {0, 3, 0}}, {})
                  .empty())
      << "a spike through the floor";
}

TEST(Clip, KeepsThePositiveSide) {
  Polygon kept;
  clip(kSquare, {Vec3::UnitX(), 0.25}, 1e-12, kept);
  EXPECT_NEAR(area_vector(kept).norm(), 0.75, kRounding);
  EXPECT_NEAR(area_vector(kept).normalized().z(), 1.0, kRounding);
  clip(kSquare, {-Vec3::UnitX(), -0.25}, 1e-12, kept);
  EXPECT_NEAR(area_vector(kept).norm(), 0.25, kRounding);
}

TEST(Clip, KeepsNothingBehindAndEverythingInFront) {
  Polygon kept;
  clip(kSquare, {Vec3::UnitX(), 1.0}, 1e-12, kept);  // touches along an edge
  EXPECT_TRUE(kept.empty());
  clip(kSquare, {Vec3::UnitX(), 0.0}, 1e-12, kept);
  EXPECT_EQ(kept.size(), 4u);
}

}  // namespace
}  // namespace truebox

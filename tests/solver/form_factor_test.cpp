// SPDX-License-Identifier: BSD-3-Clause
#include "transport/form_factor.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <random>

#include "support/tiny_scenes.h"

namespace truebox {
namespace {

using std::numbers::pi;

constexpr double kTolerance = 1e-13;       // what is asked of the kernel, relative
constexpr double kKernelRounding = 2e-12;  // relative: sums of some hundred logarithms of order 1
constexpr double kClosure = 1e-13;         // of a point's factors: a few Lambert sums

Polygon square(double edge, const Vec3& corner, const Vec3& u, const Vec3& v) {
  return {corner, corner + edge * u, corner + edge * (u + v), corner + edge * v};
}

const Vec3 kX = Vec3::UnitX(), kY = Vec3::UnitY(), kZ = Vec3::UnitZ();

double exchange_of(const Polygon& a, const Polygon& b) {
  return exchange_area_m2(PlanarPolygon(a), PlanarPolygon(b), kTolerance);
}

Polygon moved(Polygon polygon, const Eigen::Matrix3d& turn, double scale, const Vec3& shift) {
  for (Vec3& v : polygon) v = scale * (turn * v) + shift;
  return polygon;
}

struct Pair {
  std::string name;
  Polygon a, b;
};

std::vector<Pair> pairs() {
  const Polygon floor = square(1.0, Vec3::Zero(), kX, kY);
  return {{"facing", floor, square(1.0, {0, 0, 1}, kY, kX)},
          {"shared_edge", floor, square(1.0, {0, 0, 0}, kY, kZ)},
          {"apart", floor, square(0.7, {1.5, -0.4, 0.3}, kZ, kY)},
          {"across_the_horizon", floor, square(2.0, {-0.5, 0.2, -1.0}, kY, kZ)},
          {"triangle", {{0, 0, 0}, {1, 0, 0}, {0.3, 0.8, 0}}, square(1.0, {0, 0, 0.4}, kY, kX)}};
}

class ExchangeArea : public testing::TestWithParam<Pair> {};

TEST_P(ExchangeArea, IsSymmetric) {
  const auto& [name, a, b] = GetParam();
  const double forth = exchange_of(a, b), back = exchange_of(b, a);
  ASSERT_GT(forth, 0.0);
  EXPECT_NEAR(forth, back, 4e-16 * forth);
}

TEST_P(ExchangeArea, IsTheSameAfterTurningAndShifting) {
  const auto& [name, a, b] = GetParam();
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.83, Vec3(0.3, -0.5, 0.8).normalized()).toRotationMatrix();
  const Vec3 shift(3.0, -2.0, 5.0);
  const double there = exchange_of(moved(a, turn, 1.0, shift), moved(b, turn, 1.0, shift));
  // Coordinates of size 6 are rounded at 6 * 1.1e-16; near an edge the kernel follows linearly.
  EXPECT_NEAR(there / exchange_of(a, b), 1.0, 1e-12);
}

TEST_P(ExchangeArea, GrowsWithTheSquareOfTheScale) {
  const auto& [name, a, b] = GetParam();
  for (double scale : {1e-6, 1e6}) {
    const auto same = Eigen::Matrix3d::Identity();
    const double there =
        exchange_of(moved(a, same, scale, Vec3::Zero()), moved(b, same, scale, Vec3::Zero()));
    EXPECT_NEAR(there / (scale * scale) / exchange_of(a, b), 1.0, kKernelRounding) << scale;
  }
}

TEST_P(ExchangeArea, IsTheSumOverHalves) {
  const auto& [name, a, b] = GetParam();
  const Vec3 middle = centroid(a);
  const Plane cut{kX, middle.x()};
  Polygon left, right;
  clip(a, cut, 0.0, right);
  clip(a, Plane{-cut.normal, -cut.offset_m}, 0.0, left);
  EXPECT_NEAR((exchange_of(left, b) + exchange_of(right, b)) / exchange_of(a, b), 1.0,
              kKernelRounding);
}

INSTANTIATE_TEST_SUITE_P(Pairs, ExchangeArea, testing::ValuesIn(pairs()),
                         [](const auto& pair) { return pair.param.name; });

TEST(ExchangeArea, HasTheClosedFormsOfUnitSquares) {
  // Facing at distance 1: F = 2/pi (ln(2/sqrt 3) + 2 sqrt 2 atan(1/sqrt 2) - pi/2) (Howell C-11).
  const double facing = 2.0 / pi *
                        (std::log(2.0 / std::sqrt(3.0)) +
                         2.0 * std::sqrt(2.0) * std::atan(1.0 / std::sqrt(2.0)) - 0.5 * pi);
  EXPECT_NEAR(exchange_of(pairs()[0].a, pairs()[0].b), facing, 1e-14);
  // Shared edge, right angle: closure of the cube.
  EXPECT_NEAR(exchange_of(pairs()[1].a, pairs()[1].b), 0.25 * (1.0 - facing), 1e-14);
}

TEST(ExchangeArea, ClosesTheUnitCube) {
  const Scene cube = tiny::cube(1.0, 0.0);
  for (const Surface& a : cube.surfaces) {
    double sum = 0.0;
    for (const Surface& b : cube.surfaces)
      if (&a != &b) sum += exchange_of(a.pieces[0], b.pieces[0]);
    EXPECT_NEAR(sum, 1.0, kClosure) << a.name;
  }
}

TEST(ExchangeArea, ClosesABoxWithEdgesOneToAThousand) {
  Scene box = tiny::grey_scene(0.0);
  tiny::add_box(box, "box", Vec3::Zero(), {1.0, 30.0, 1000.0}, true);
  for (const Surface& a : box.surfaces) {
    double sum = 0.0;
    for (const Surface& b : box.surfaces)
      if (&a != &b) sum += exchange_of(a.pieces[0], b.pieces[0]);
    // The long faces see each other 1000 edge lengths along: their sums lose that many digits.
    EXPECT_NEAR(sum / area_vector(a.pieces[0]).norm(), 1.0, 1e-10) << a.name;
  }
}

// A random tetrahedron with outward normals turned in.
std::vector<Polygon> tetrahedron(std::mt19937_64& random) {
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (;;) {
    Vec3 v[4];
    for (Vec3& p : v) p = {uniform(random), uniform(random), uniform(random)};
    if (std::abs((v[1] - v[0]).cross(v[2] - v[0]).dot(v[3] - v[0])) < 0.5) continue;
    const Vec3 inside = 0.25 * (v[0] + v[1] + v[2] + v[3]);
    std::vector<Polygon> faces = {
        {v[0], v[1], v[2]}, {v[0], v[1], v[3]}, {v[0], v[2], v[3]}, {v[1], v[2], v[3]}};
    for (Polygon& face : faces)
      if (plane_of(face).distance_m(inside) < 0.0) std::swap(face[1], face[2]);
    return faces;
  }
}

TEST(ExchangeArea, ClosesRandomTetrahedra) {
  std::mt19937_64 random(20);
  for (int trial = 0; trial < 10; ++trial) {
    const auto faces = tetrahedron(random);
    for (std::size_t i = 0; i < 4; ++i) {
      double sum = 0.0;
      for (std::size_t j = 0; j < 4; ++j)
        if (i != j) sum += exchange_of(faces[i], faces[j]);
      EXPECT_NEAR(sum / area_vector(faces[i]).norm(), 1.0, 1e-12) << trial << ", face " << i;
    }
  }
}

TEST(ExchangeArea, LosesTwoGapsBetweenNearlyTouchingPlates) {
  // F = 1 - 2 d / pi ln(1/d) ... has no short form; strips do: for d << 1 the four sides lose
  // A F = 1 - 4 integral over one side of its own view, whose factor to the other plate's rim is
  // found from closure with the four side walls of height d.
  constexpr double kGap = 1e-6;
  const Polygon low = square(1.0, Vec3::Zero(), kX, kY);
  const Polygon high = square(1.0, {0, 0, kGap}, kY, kX);
  Scene slit = tiny::grey_scene(0.0);
  tiny::add_box(slit, "slit", Vec3::Zero(), {1, 1, kGap}, true);
  double sides = 0.0;
  for (std::size_t k = 2; k < 6; ++k) sides += exchange_of(low, slit.surfaces[k].pieces[0]);
  EXPECT_NEAR(exchange_of(low, high) + sides, 1.0, 1e-12);
  EXPECT_NEAR(sides, 2.0 * kGap, 1e-4 * kGap) << "each wall, d tall, sends half its light down";
}

TEST(ExchangeArea, HoldsABillionthAtTheExtremes) {
  // mpmath, double contour with 45 to 60 digits: also rows of reference/analytic/view_factors.csv.
  const Polygon unit = square(1.0, Vec3::Zero(), kX, kY);
  const Polygon sliver = {{0, 0, 0}, {1, 0, 0}, {0.5, 1e-4, 0}};
  const double sliver_area = 0.5e-4;
  EXPECT_NEAR(exchange_of(unit, square(1.0, 1e6 * kZ, kY, kX)) / 3.18309886183578464946978513e-13,
              1.0, 1e-9);
  EXPECT_NEAR(exchange_of(sliver, square(1.0, 0.5 * kZ, kY, kX)) / sliver_area /
                  0.312898570354031758179973895097,
              1.0, 1e-9);
  EXPECT_NEAR(exchange_of(sliver, square(1.0, Vec3::Zero(), kZ, kX)) / sliver_area /
                  0.499970570320873874409201724141,
              1.0, 1e-9);
}

TEST(ExchangeArea, EndsWhereEdgesCrossUnderASmallAngle) {
  // A wall whose foot crosses an edge of the floor in its middle. Halving towards all of the other
  // edge instead of the crossing takes 1 : angle steps.
  const Polygon floor = square(1.0, Vec3::Zero(), kX, kY);
  const auto with_wall = [&](double angle) {
    const Vec3 along(std::cos(angle), std::sin(angle), 0.0), corner = Vec3(0.5, 0, 0) - 0.8 * along;
    return exchange_of(floor,
                       {corner, corner + kZ, corner + kZ + 1.5 * along, corner + 1.5 * along});
  };
  const double parallel = with_wall(0.0);
  ASSERT_GT(parallel, 0.1);
  // A foot off by d changes the exchange by d ln d at most, and by rounding.
  for (double angle : {1e-3, 1e-5, 1e-8, 1e-11, 1e-13, 1e-15})
    EXPECT_NEAR(with_wall(angle), parallel, -angle * std::log(angle) + kKernelRounding) << angle;
}

TEST(ExchangeArea, FarPairsFollowThePointKernel) {
  constexpr double kDistance = 1e3;
  const Polygon low = square(1.0, {-0.5, -0.5, 0}, kX, kY);
  const Polygon high = square(1.0, {-0.5, -0.5, kDistance}, kY, kX);
  // 1/(pi d^2) (1 - <r^2>/d^2 ...), <2 rho^2> = 2 (1/6 + 1/6): relative 7e-7 less.
  const double point = 1.0 / (pi * kDistance * kDistance);
  const double second_order = 2.0 * (1.0 / 6.0 + 1.0 / 6.0) / (kDistance * kDistance);
  EXPECT_NEAR(exchange_of(low, high) / point, 1.0 - second_order, 1e-11);
}

TEST(ExchangeArea, IsNothingForBacksAndCoplanarPolygons) {
  const Polygon floor = square(1.0, Vec3::Zero(), kX, kY);
  EXPECT_EQ(exchange_of(floor, square(1.0, {0, 0, 1}, kX, kY)), 0.0);   // shows its back
  EXPECT_EQ(exchange_of(floor, square(1.0, {0, 0, -1}, kX, kY)), 0.0);  // behind
  EXPECT_EQ(exchange_of(floor, square(1.0, {2, 0, 0}, kX, kY)), 0.0);   // coplanar
}

TEST(PointToPolygon, SeesHalfTheSphereOfABox) {
  const Scene cube = tiny::cube(1.0, 0.0);
  std::mt19937_64 random(21);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::normal_distribution<double> gauss;
  for (int trial = 0; trial < 100; ++trial) {
    const Vec3 point(uniform(random), uniform(random), uniform(random));
    const Vec3 normal = Vec3(gauss(random), gauss(random), gauss(random)).normalized();
    double sum = 0.0;
    for (const Surface& s : cube.surfaces) sum += point_to_polygon(point, normal, s.pieces[0]);
    EXPECT_NEAR(sum, 1.0, 5.0 * kClosure) << trial;  // horizon cuts on up to five faces
  }
}

TEST(PointToPolygon, TinySourceFollowsTheCosineKernel) {
  constexpr double kEdge = 1e-5, kDistance = 3.0;
  const Polygon source = square(kEdge, {-0.5 * kEdge, -0.5 * kEdge, kDistance}, kY, kX);
  for (double x : {0.0, 0.5, 1.5}) {
    const double r2 = x * x + kDistance * kDistance;
    const double kernel = kEdge * kEdge * kDistance * kDistance / (pi * r2 * r2);
    // Rounding of the contour sum grows like distance / size, 3e5 here: nine digits are promised.
    EXPECT_NEAR(point_to_polygon({x, 0, 0}, kZ, source) / kernel, 1.0, 1e-9) << x;
  }
}

TEST(PointToPolygon, CutsAtTheHorizon) {
  // A wall as deep below the element's horizon as above it: only the upper half is seen.
  const Polygon wall = {{1, -1, -1}, {1, -1, 1}, {1, 1, 1}, {1, 1, -1}};  // normal -x
  const Polygon upper = {{1, -1, 0}, {1, -1, 1}, {1, 1, 1}, {1, 1, 0}};
  const double whole = point_to_polygon(Vec3::Zero(), kZ, wall);
  ASSERT_GT(whole, 0.05);
  EXPECT_NEAR(whole, point_to_polygon(Vec3::Zero(), kZ, upper), 1e-16);
  EXPECT_EQ(point_to_polygon({0, 0, 2}, kZ, wall), 0.0);  // all below
}

TEST(PointToPolygon, SeesNothingOfABack) {
  EXPECT_EQ(point_to_polygon(Vec3::Zero(), kZ, square(1.0, {-0.5, -0.5, 1}, kX, kY)), 0.0);
}

TEST(PointToPolygon, FillsTheViewOfAHugeCeiling) {
  // A square of edge 2 a at height 1 seen from below its centre:
  // F = 4/pi * a/sqrt(1 + a^2) * atan(a/sqrt(1 + a^2)) (Howell B-3, four quarters).
  for (double a : {0.01, 1.0, 1e3, 1e6}) {
    const double s = a / std::sqrt(1.0 + a * a);
    EXPECT_NEAR(point_to_polygon(Vec3::Zero(), kZ, square(2.0 * a, {-a, -a, 1.0}, kY, kX)) /
                    (4.0 / pi * s * std::atan(s)),
                1.0, 1e-14)
        << a;
  }
}

}  // namespace
}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "transport/view_factors.h"

#include <gmock/gmock.h>

#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include "support/tiny_scenes.h"
#include "transport/exact_visibility.h"
#include "transport/hemicube.h"
#include "transport/nusselt.h"
#include "transport/shaft.h"

namespace truebox {
namespace {

const Vec3 kX = Vec3::UnitX(), kY = Vec3::UnitY(), kZ = Vec3::UnitZ();

Polygon square(double edge, const Vec3& corner, const Vec3& u, const Vec3& v) {
  return {corner, corner + edge * u, corner + edge * (u + v), corner + edge * v};
}

// Two unit squares at distance 1 and a smaller one between them, as large as the name says.
Scene squares_with_blocker(const Vec3& corner, double edge) {
  Scene scene = tiny::grey_scene(0.0);
  tiny::add_surface(scene, "low", square(1.0, Vec3::Zero(), kX, kY));
  tiny::add_surface(scene, "high", square(1.0, kZ, kY, kX));
  if (edge > 0.0) tiny::add_surface(scene, "blocker", square(edge, corner, kX, kY));
  return scene;
}

Scene turned(Scene scene, const Eigen::Matrix3d& turn, double scale, const Vec3& shift) {
  for (Surface& surface : scene.surfaces)
    for (Polygon& piece : surface.pieces)
      for (Vec3& v : piece) v = scale * (turn * v) + shift;
  return scene;
}

// One suite for every method: what a method answers may be rough, what it claims must hold.
class EveryMethod : public testing::TestWithParam<ViewFactorMethod> {
 protected:
  static ViewFactorEstimate between(const Scene& scene, std::size_t i, std::size_t j,
                                    std::uint64_t seed = 1) {
    ViewFactorOptions options;
    options.method = GetParam();
    options.relative_tolerance = 1e-7;
    options.arcs = 16;
    options.resolution = 32;
    options.rays = 256;
    options.seed = seed;
    return ViewFactors(scene).between(i, j, options);
  }
};

TEST_P(EveryMethod, IsReciprocalToTheLastBit) {
  const Scene scene = tiny::cube_with_block(1.0, 0.0);
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < scene.surfaces.size(); ++j)
      EXPECT_EQ(between(scene, i, j).exchange_area_m2, between(scene, j, i).exchange_area_m2)
          << i << ' ' << j;
}

TEST_P(EveryMethod, ClosesAnEmptyCubeWithinItsBounds) {
  const Scene cube = tiny::cube(1.0, 0.0);
  for (std::size_t i = 0; i < 6; ++i) {
    double sum = 0.0, bound = 0.0;
    for (std::size_t j = 0; j < 6; ++j) {
      const auto part = between(cube, i, j);
      sum += part.exchange_area_m2;
      bound += part.error_bound_m2;
    }
    EXPECT_LE(std::abs(sum - 1.0), bound) << i;
  }
}

TEST_P(EveryMethod, ClosesACubeWithABlockWithinItsBounds) {
  const Scene scene = tiny::cube_with_block(1.0, 0.0);
  const ViewFactors factors(scene);
  for (std::size_t i = 0; i < scene.surfaces.size(); ++i) {
    if (scene.surfaces[i].name == "block 0") continue;  // lies on the floor
    double sum = 0.0, bound = 1e-13;
    for (std::size_t j = 0; j < scene.surfaces.size(); ++j) {
      const auto part = between(scene, i, j);
      sum += part.exchange_area_m2;
      bound += part.error_bound_m2;
    }
    // What lies under the block sees nothing: its underside touches it.
    const double covered = i == 0 ? area_vector(scene.surfaces[6].pieces[0]).norm() : 0.0;
    EXPECT_LE(std::abs(sum - factors.area_m2(i) + covered), bound) << scene.surfaces[i].name;
  }
}

TEST_P(EveryMethod, SaysNothingForBacks) {
  Scene scene = tiny::grey_scene(0.0);
  tiny::add_surface(scene, "low", square(1.0, Vec3::Zero(), kX, kY));
  tiny::add_surface(scene, "its back above", square(1.0, kZ, kX, kY));
  tiny::add_surface(scene, "coplanar and overlapping", square(1.0, {0.5, 0.5, 0.0}, kX, kY));
  tiny::add_surface(scene, "below", square(1.0, -kZ, kY, kX));
  for (std::size_t j = 1; j < 4; ++j) {
    const auto none = between(scene, 0, j);
    EXPECT_EQ(none.exchange_area_m2, 0.0) << scene.surfaces[j].name;
    EXPECT_EQ(none.error_bound_m2, 0.0) << scene.surfaces[j].name;
  }
}

TEST_P(EveryMethod, FindsAWallThatHidesAll) {
  const auto none = between(squares_with_blocker({-0.5, -0.5, 0.3}, 2.0), 0, 1);
  EXPECT_LE(none.exchange_area_m2, none.error_bound_m2);
  EXPECT_EQ(GetParam() == ViewFactorMethod::analytic, none.exchange_area_m2 > 0.0);
}

TEST_P(EveryMethod, HoldsItsBoundBehindABlocker) {
  // Corner blocker of View3D's example square-obstruction, and a centred one: certified values of
  // reference/analytic/view_factors.csv.
  const std::pair<Scene, double> cases[] = {
      {squares_with_blocker({0.0, 0.0, 0.5}, 0.5), 0.1498686717737905},
      {squares_with_blocker({0.25, 0.25, 0.5}, 0.5), 0.0995062945989848}};
  for (const auto& [scene, certified] : cases) {
    const auto found = between(scene, 0, 1);
    EXPECT_LE(std::abs(found.exchange_area_m2 - certified), found.error_bound_m2);
  }
}

TEST_P(EveryMethod, IsTheSameTurnedScaledAndFarAway) {
  const Scene scene = squares_with_blocker({0.2, 0.1, 0.4}, 0.5);
  const auto here = between(scene, 0, 1);
  const auto expect_same = [&](const ViewFactorEstimate& there, double scale, double rounding) {
    // A hemicube stands turned to its own axes: its pixels differ, within aliasing. Nusselt's
    // chords depend on how the visible part is cut, which rounding may change.
    const double slack =
        GetParam() == ViewFactorMethod::hemicube || GetParam() == ViewFactorMethod::nusselt
            ? 2.0 * here.error_bound_m2
            : 0.0;
    EXPECT_NEAR(there.exchange_area_m2 / (scale * scale), here.exchange_area_m2,
                rounding * here.exchange_area_m2 + slack)
        << scale;
  };
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.83, Vec3(0.3, -0.5, 0.8).normalized()).toRotationMatrix();
  const auto same = Eigen::Matrix3d::Identity();
  // Rays that graze an edge may change sides by rounding: none of 256 does here.
  expect_same(between(turned(scene, turn, 1.0, Vec3::Zero()), 0, 1), 1.0, 1e-11);
  for (double scale : {1e-6, 1e6})
    expect_same(between(turned(scene, same, scale, Vec3::Zero()), 0, 1), scale, 1e-11);
  // Coordinates near 1e6 are themselves rounded at 1.2e-10; the factor follows them linearly, with
  // slopes below 4 for these squares. No program can do better from such coordinates.
  expect_same(between(turned(scene, turn, 1.0, {1e6, -2e5, 3e5}), 0, 1), 1.0, 1e-9);
}

TEST_P(EveryMethod, AddsUpOverHalvesOfTheSource) {
  const Scene whole = squares_with_blocker({0.2, 0.1, 0.4}, 0.5);
  Scene halves = whole;
  halves.surfaces[1].pieces = {{{0, 0, 1}, {0, 1, 1}, {0.3, 1, 1}, {0.3, 0, 1}}};
  tiny::add_surface(halves, "rest", {{0.3, 0, 1}, {0.3, 1, 1}, {1, 1, 1}, {1, 0, 1}});
  const auto all = between(whole, 0, 1), one = between(halves, 0, 1), two = between(halves, 0, 3);
  EXPECT_LE(std::abs(one.exchange_area_m2 + two.exchange_area_m2 - all.exchange_area_m2),
            one.error_bound_m2 + two.error_bound_m2 + all.error_bound_m2);
}

INSTANTIATE_TEST_SUITE_P(Methods, EveryMethod, testing::ValuesIn(kViewFactorMethods),
                         [](const auto& method) {
                           std::string name(name_of(method.param));
                           std::erase(name, '-');
                           return name;
                         });

TEST(Planner, TakesTheCheapestThatIsExact) {
  const ViewFactorOptions options;
  const auto method_of = [&](const Scene& scene) {
    return ViewFactors(scene).between(0, 1, options).method;
  };
  EXPECT_EQ(method_of(squares_with_blocker(Vec3::Zero(), 0.0)), ViewFactorMethod::analytic);
  EXPECT_EQ(method_of(squares_with_blocker({2.0, 0.0, 0.5}, 0.5)), ViewFactorMethod::analytic)
      << "a blocker beside the shaft";
  EXPECT_EQ(method_of(squares_with_blocker({0.0, 0.0, 1.5}, 0.5)), ViewFactorMethod::analytic)
      << "a blocker beyond";
  EXPECT_EQ(method_of(squares_with_blocker({-0.5, -0.5, 0.5}, 2.0)), ViewFactorMethod::hidden);
  EXPECT_EQ(method_of(squares_with_blocker({0.2, 0.2, 0.5}, 0.5)),
            ViewFactorMethod::exact_visibility);
}

TEST(Planner, TakesABlockForOneSolid) {
  // A block stands on its edge between two small squares: each of the two faces that look at one of
  // them hides half of the other, together all.
  Scene scene = tiny::grey_scene(0.0);
  tiny::add_surface(scene, "left", square(0.2, {-2.0, -0.1, -0.1}, kY, kZ));
  tiny::add_surface(scene, "right", square(0.2, {2.0, -0.1, -0.1}, kZ, kY));
  tiny::add_box(scene, "block", {-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}, false);
  const Eigen::Matrix3d on_edge = Eigen::AngleAxisd(0.25 * std::numbers::pi, kZ).toRotationMatrix();
  for (std::size_t s = 2; s < scene.surfaces.size(); ++s)
    for (Vec3& v : scene.surfaces[s].pieces[0]) v = on_edge * v;
  EXPECT_EQ(ViewFactors(scene).between(0, 1, {}).method, ViewFactorMethod::hidden);
}

TEST(ExactVisibility, ReachesTheToleranceAskedForWithFewerPointsWhenRough) {
  const Scene scene = squares_with_blocker({0.25, 0.25, 0.5}, 0.5);
  std::size_t previous = 0;
  for (double tolerance : {1e-3, 1e-6, 1e-9, 1e-11}) {
    ViewFactorOptions options;
    options.relative_tolerance = tolerance;
    const auto found = ViewFactors(scene).between(0, 1, options);
    EXPECT_TRUE(found.converged);
    EXPECT_LE(found.error_bound_m2, tolerance * found.exchange_area_m2);
    EXPECT_NEAR(found.exchange_area_m2 / 0.0995062945989847863, 1.0, tolerance);
    EXPECT_GE(found.evaluations, previous);
    previous = found.evaluations;
  }
}

TEST(ExactVisibility, SaysWhenItRanOutOfPoints) {
  ViewFactorOptions options;
  options.relative_tolerance = 1e-12;
  options.most_evaluations = 100;
  const auto found =
      ViewFactors(squares_with_blocker({0.25, 0.25, 0.5}, 0.5)).between(0, 1, options);
  EXPECT_FALSE(found.converged);
  EXPECT_GT(found.error_bound_m2, 1e-12 * found.exchange_area_m2);
  EXPECT_LE(std::abs(found.exchange_area_m2 - 0.0995062945989847863), found.error_bound_m2);
}

TEST(ExactVisibility, SeesThroughAThinSlit) {
  // Two half planes leave a slit of width w in the middle: far narrower than any grid of rays. For
  // w -> 0 each point of the floor sees a strip of the ceiling as wide as 2 w; the answer grows
  // linearly with w, so two widths must agree after scaling.
  const auto through = [](double w) {
    Scene scene = squares_with_blocker(Vec3::Zero(), 0.0);
    tiny::add_surface(scene, "left",
                      {{-9, -9, 0.5}, {0.5 - w / 2, -9, 0.5}, {0.5 - w / 2, 9, 0.5}, {-9, 9, 0.5}});
    tiny::add_surface(scene, "right",
                      {{0.5 + w / 2, -9, 0.5}, {9, -9, 0.5}, {9, 9, 0.5}, {0.5 + w / 2, 9, 0.5}});
    ViewFactorOptions options;
    options.relative_tolerance = 1e-7;
    const auto found = ViewFactors(scene).between(0, 1, options);
    EXPECT_TRUE(found.converged) << w;
    return found.exchange_area_m2;
  };
  const double wide = through(1e-3), narrow = through(1e-6);
  ASSERT_GT(narrow, 0.0);
  EXPECT_NEAR(narrow / wide * 1e3, 1.0, 1e-3);  // the width itself is 1e-3 of the distance
}

TEST(ExactVisibility, HoldsJustAboveAReceiver) {
  // A corner of the floor covered at height h: as h -> 0 exactly that corner is lost. Seen from the
  // ceiling its shadow's inner edges lie h (0.3 - Y) / (1 - h) off, Y the ceiling point: the loss
  // is linear in h, about 2 sides x 0.3 long x 0.2 h x the local factor.
  for (double h : {1e-3, 1e-6}) {
    const Scene scene = squares_with_blocker({0, 0, h}, 0.3);
    Scene rest = tiny::grey_scene(0.0);
    rest.surfaces.push_back({"rest",
                             0,
                             {{{0.3, 0, 0}, {1, 0, 0}, {1, 0.3, 0}, {0.3, 0.3, 0}},
                              {{0, 0.3, 0}, {1, 0.3, 0}, {1, 1, 0}, {0, 1, 0}}}});
    tiny::add_surface(rest, "high", square(1.0, kZ, kY, kX));
    ViewFactorOptions options;
    options.relative_tolerance = 1e-6;
    const auto found = ViewFactors(scene).between(0, 1, options);
    EXPECT_TRUE(found.converged) << h;
    const double limit = ViewFactors(rest).between(0, 1, options).exchange_area_m2;
    EXPECT_NEAR(found.exchange_area_m2, limit, 2.0 * h) << h;
    EXPECT_GE(std::abs(found.exchange_area_m2 - limit), 0.001 * h) << "the penumbra is there";
  }
}

TEST(ExactVisibility, LeaksNothingAlongSharedEdges) {
  // The same wall in one piece, and cut into triangles that share edges at odd angles.
  Scene whole = squares_with_blocker({0.1, 0.2, 0.4}, 0.6), cut = whole;
  const Polygon q = whole.surfaces[2].pieces[0];
  const Vec3 inside(0.43, 0.51, 0.4);
  cut.surfaces[2].pieces.clear();
  for (std::size_t k = 0; k < 4; ++k)
    cut.surfaces[2].pieces.push_back({q[k], q[(k + 1) % 4], inside});
  const ViewFactorOptions options;
  const double once = ViewFactors(whole).between(0, 1, options).exchange_area_m2;
  EXPECT_NEAR(ViewFactors(cut).between(0, 1, options).exchange_area_m2, once, 2e-9 * once);
}

TEST(RayCasting, StandardErrorCoversTheTruth) {
  // 200 seeds, 16 and 256 rays. Evenly spread rays do better than the independent ones that the
  // standard error is made for, so three of them must cover nearly always: at 99.7 % of 400 trials
  // 1.1 misses are expected, 6 or more have p < 0.001.
  const Scene scene = squares_with_blocker({0.25, 0.25, 0.5}, 0.5);
  const ViewFactors factors(scene);
  int missed = 0;
  double mean = 0.0;
  for (int rays : {16, 256})
    for (std::uint64_t seed = 1; seed <= 200; ++seed) {
      ViewFactorOptions options;
      options.method = ViewFactorMethod::ray_casting;
      options.rays = rays;
      options.seed = seed;
      const auto found = factors.between(0, 1, options);
      const double error = found.exchange_area_m2 - 0.0995062945989847863;
      missed += std::abs(error) > 3.0 * found.standard_error_m2;
      if (rays == 256) mean += error / 200.0;
    }
  EXPECT_LT(missed, 6);
  // One run of 256 independent rays has 0.006; the mean of 200 has 0.0005.
  EXPECT_LT(std::abs(mean), 3.0 * 0.0005) << "no bias";
}

TEST(Nusselt, ChordsFallShortByTheSquareOfTheirLength) {
  // Order of convergence: twice the chords, a quarter of the error.
  const Polygon ceiling = square(1.0, {-0.2, -0.4, 0.7}, kY, kX);
  const double exact = point_to_polygon(Vec3::Zero(), kZ, ceiling);
  double previous = 0.0;
  for (int arcs : {4, 8, 16, 32, 64}) {
    const double error = exact - nusselt_factor(Vec3::Zero(), kZ, ceiling, arcs);
    if (previous > 0.0) {
      EXPECT_NEAR(previous / error, 4.0, 0.1) << arcs;
    }
    previous = error;
  }
  EXPECT_LT(std::abs(previous), 1e-4);
}

TEST(Nusselt, OutlineLiesInTheDiscAndRoundsAtTheHorizon) {
  // A wall that reaches below the horizon touches the rim of the disc.
  const Polygon wall = {{1, -1, -1}, {1, -1, 1}, {1, 1, 1}, {1, 1, -1}};
  double farthest = 0.0;
  for (const auto& p : nusselt_outline(Vec3::Zero(), kZ, wall, 8))
    farthest = std::max(farthest, p.norm());
  EXPECT_NEAR(farthest, 1.0, 1e-12);
  EXPECT_TRUE(nusselt_outline({2, 0, 0}, kZ, wall, 8).empty()) << "seen from behind";
}

TEST(Hemicube, PixelsAddUpToOne) {
  // A box about the element fills every pixel: their exact factors sum to one, at any resolution.
  const Scene cube = tiny::cube(1.0, 0.0);
  for (int resolution : {2, 8, 50}) {
    double sum = 0.0;
    for (std::size_t k = 1; k < 6; ++k) {
      const Polygon& wall = cube.surfaces[k].pieces[0];
      sum +=
          hemicube_factor({0.31415, 0.47123, 0.0}, kZ, wall, plane_of(wall), {}, resolution).factor;
    }
    EXPECT_NEAR(sum, 1.0, 1e-12) << resolution;
  }
}

TEST(Hemicube, AliasingIsWithinItsBoundAndShrinksWithThePixels) {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  double previous = 1.0;
  for (int resolution : {8, 32, 128}) {
    double mean_bound = 0.0;
    for (int trial = 0; trial < 20; ++trial) {
      Polygon source = {{uniform(random), uniform(random), 0.5 + 0.3 * uniform(random)},
                        {uniform(random), uniform(random), 0.5 + 0.3 * uniform(random)},
                        {uniform(random), uniform(random), 0.5 + 0.3 * uniform(random)}};
      if (plane_of(source).distance_m(Vec3::Zero()) < 0.0) std::swap(source[0], source[1]);
      const auto seen = hemicube_factor(Vec3::Zero(), kZ, source, plane_of(source), {}, resolution);
      EXPECT_LE(std::abs(seen.factor - point_to_polygon(Vec3::Zero(), kZ, source)),
                seen.aliasing_bound + 1e-14);
      mean_bound += seen.aliasing_bound / 20.0;
    }
    EXPECT_LT(mean_bound, 0.5 * previous);
    previous = mean_bound;
  }
}

TEST(RayCasting, HidesNothingFromItself) {
  // Two walls that share an edge, and the floor that both stand on: a ray that starts on a surface
  // must not be stopped by it, however close to the edge.
  const Scene cube = tiny::cube(1.0, 0.0);
  ViewFactorOptions options;
  options.method = ViewFactorMethod::ray_casting;
  options.rays = 4096;
  for (std::size_t j = 1; j < 6; ++j) {
    const auto rays = ViewFactors(cube).between(0, j, options);
    options.method = ViewFactorMethod::analytic;
    EXPECT_EQ(rays.exchange_area_m2, ViewFactors(cube).between(0, j, options).exchange_area_m2);
    options.method = ViewFactorMethod::ray_casting;
  }
}

TEST(Shaft, AgreesWithBruteForceSegments) {
  // Random triangles: "none" and "full" are exact claims, held against 400 segments each.
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0), unit(0.0, 1.0);
  const auto triangle = [&](double z) {
    Polygon p;
    for (int k = 0; k < 3; ++k)
      p.push_back({uniform(random), uniform(random), z + 0.3 * uniform(random)});
    return p;
  };
  const auto inside = [&](const Polygon& p) {
    const double s = std::sqrt(unit(random)), t = unit(random);
    return Vec3(p[0] + s * ((1 - t) * (p[1] - p[0]) + t * (p[2] - p[0])));
  };
  std::map<ShaftOcclusion, int> seen;
  for (int trial = 0; trial < 4000; ++trial) {
    Polygon a = triangle(0.0), b = triangle(2.0), c = triangle(1.0);
    if (trial % 2)
      for (Vec3& v : c) v = 3.0 * v - Vec3(0, 0, 2);  // often large enough to hide all
    if (plane_of(a).normal.z() < 0) std::swap(a[0], a[1]);
    if (plane_of(b).normal.z() > 0) std::swap(b[0], b[1]);
    const Blocker blocker{c, plane_of(c)};
    const auto verdict = shaft_occlusion(a, plane_of(a), b, plane_of(b), blocker, 1e-12);
    ++seen[verdict];
    for (int k = 0; k < 400 && verdict != ShaftOcclusion::partial; ++k) {
      const Vec3 from = inside(a), to = inside(b);
      if (plane_of(a).distance_m(to) <= 0.0 || plane_of(b).distance_m(from) <= 0.0) continue;
      const double h = blocker.plane.distance_m(from), g = blocker.plane.distance_m(to);
      bool met = h * g < 0.0;
      const Vec3 x = from + h / (h - g) * (to - from);
      for (std::size_t e = 0; e < 3 && met; ++e)
        met = blocker.plane.normal.cross(c[(e + 1) % 3] - c[e]).dot(x - c[e]) > 0.0;
      ASSERT_EQ(met, verdict == ShaftOcclusion::full) << trial;
    }
  }
  EXPECT_GT(seen[ShaftOcclusion::none], 100);
  EXPECT_GT(seen[ShaftOcclusion::full], 50);
  EXPECT_GT(seen[ShaftOcclusion::partial], 100);
}

}  // namespace
}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>

#include "support/tiny_scenes.h"
#include "transport/exact_visibility.h"
#include "transport/shadow_cones.h"
#include "transport/shadow_lanes.h"

namespace truebox {
namespace {

// The faces of a box from number `first` on, normals outward; 0 is the floor.
std::vector<Blocker> box_faces(const Vec3& low, const Vec3& high, std::size_t first = 0) {
  Scene scene = tiny::grey_scene(1.0);
  tiny::add_box(scene, "box", low, high, false);
  std::vector<Blocker> faces;
  for (std::size_t k = first; k < 6; ++k) {
    const Polygon& p = scene.surfaces[k].pieces[0];
    faces.push_back({p, plane_of(p)});
  }
  return faces;
}

TEST(ConvexOccluders, AreABlockWithOrWithoutOneFace) {
  const auto closed = box_faces({0, 0, 0}, {1, 2, 3});
  ASSERT_EQ(convex_occluders(closed, 1e-9).size(), 1u);
  EXPECT_EQ(convex_occluders(closed, 1e-9)[0].edges.size(), 12u);
  const auto on_the_floor = box_faces({0, 0, 0}, {1, 2, 3}, 1);
  ASSERT_EQ(convex_occluders(on_the_floor, 1e-9).size(), 1u);
  EXPECT_EQ(convex_occluders(on_the_floor, 1e-9)[0].faces.size(), 6u) << "the missing one, too";
  EXPECT_EQ(convex_occluders(box_faces({0, 0, 0}, {1, 2, 3}, 2), 1e-9).size(), 4u)
      << "two missing: light passes through";
  auto with_something_inside = on_the_floor;
  with_something_inside.push_back(
      {{{0.2, 0.2, 1}, {0.4, 0.2, 1}, {0.4, 0.4, 1}}, {Vec3::UnitZ(), 1.0}});
  EXPECT_EQ(convex_occluders(with_something_inside, 1e-9).size(), 6u)
      << "from inside one could look out where the face is missing";
  auto pulled = closed;
  for (Blocker& face : pulled)
    for (Vec3& v : face.polygon)
      if (v == Vec3(1, 2, 3)) v = Vec3(1, 2, 3.5);
  EXPECT_EQ(convex_occluders(pulled, 1e-9).size(), 6u) << "not convex any more";
}

TEST(ConvexOccluders, HideWhatNoSingleFaceDoes) {
  // None and full must hold for every segment of the shaft.
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0), unit(0.0, 1.0);
  const auto faces = box_faces({-0.3, -0.2, -0.25}, {0.35, 0.3, 0.2});
  const auto solids = convex_occluders(faces, 1e-12);
  int none = 0, full = 0, full_by_no_face = 0;
  const auto meets = [&](const Vec3& a, const Vec3& b) {
    double enter = 0.0, leave = 1.0;
    for (const Plane& face : solids[0].faces) {
      const double from = face.distance_m(a), to = face.distance_m(b);
      if (from > 0.0 && to > 0.0) return false;
      if (from > 0.0) enter = std::max(enter, from / (from - to));
      if (to > 0.0) leave = std::min(leave, from / (from - to));
    }
    return enter < leave;
  };
  for (int trial = 0; trial < 4000; ++trial) {
    const auto square = [&](double x) {
      const Vec3 c(x, 0.4 * uniform(random), 0.4 * uniform(random));
      const double s = 0.02 + 0.2 * unit(random);
      return Polygon{c, c + Vec3(0, s, 0), c + Vec3(0, s, s), c + Vec3(0, 0, s)};
    };
    const Polygon a = square(-1.0), b = square(1.0);
    const Plane plane_a{Vec3::UnitX(), -1.0}, plane_b{-Vec3::UnitX(), -1.0};
    const ShaftOcclusion found = shaft_occlusion(a, plane_a, b, plane_b, solids[0], 1e-12);
    if (found == ShaftOcclusion::partial) continue;
    for (int k = 0; k < 20; ++k) {
      const auto point_of = [&](const Polygon& p) -> Vec3 {
        return p[0] + unit(random) * (p[1] - p[0]) + unit(random) * (p[3] - p[0]);
      };
      EXPECT_EQ(meets(point_of(a), point_of(b)), found == ShaftOcclusion::full) << trial;
    }
    none += found == ShaftOcclusion::none;
    if (found != ShaftOcclusion::full) continue;
    ++full;
    full_by_no_face += std::none_of(faces.begin(), faces.end(), [&](const Blocker& face) {
      return shaft_occlusion(a, plane_a, b, plane_b, face, 1e-12) == ShaftOcclusion::full;
    });
  }
  EXPECT_GT(none, 100);
  EXPECT_GT(full, 100);
  EXPECT_GT(full_by_no_face, 10);
}

TEST(ShadowCones, AgreeWithExactPartsFarAway) {
  // A small source far away behind random triangles; the kernel at centroids is of second order in
  // size over distance, here (0.2 / 2)^2.
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(-0.3, 0.3);
  const PlanarPolygon source(Polygon{{0, 0, 2}, {0, 0.2, 2}, {0.2, 0.2, 2}, {0.2, 0, 2}});
  VisibleParts parts;
  ShadowParts shadow;
  const Vec3 point = Vec3::Zero(), normal = Vec3::UnitZ();
  int partly = 0;
  for (int trial = 0; trial < 500; ++trial) {
    std::vector<Blocker> blockers;
    for (int k = 0; k < 3; ++k) {
      Polygon p;
      for (int c = 0; c < 3; ++c)
        p.push_back({uniform(random), uniform(random), 1 + uniform(random)});
      blockers.push_back({p, plane_of(p)});
    }
    const auto solids = convex_occluders(blockers, 1e-12);
    std::vector<ShadowCone> cones(3);
    std::vector<const ShadowCone*> active;
    std::vector<const Blocker*> all;
    for (std::size_t k = 0; k < 3; ++k) {
      all.push_back(&blockers[k]);
      if (ShadowCone::make(point, normal, solids[k], 1e-12, cones[k]) == ShadowCone::Hides::region)
        active.push_back(&cones[k]);
    }
    double seen = 0.0;
    for (const Polygon& part : parts(point, source.vertices, source.plane, all))
      seen += point_to_polygon(point, normal, part);
    const double whole = point_to_polygon(point, normal, source.vertices);
    const double exact = 1.0 - seen / whole;
    ASSERT_TRUE(shadow.cut(source.vertices, active));
    const double found = shadow.hidden_share(point, normal, source.plane.normal);
    EXPECT_NEAR(shadow.visible_factor(point, normal), seen, 1e-14 * whole);
    for (const ShadowCone* cone : active) {
      const ShadowTest test = test_shadow(*cone, source);
      ASSERT_TRUE(shadow.cut(source.vertices, {&cone, 1}));
      const double alone = shadow.hidden_share(point, normal, source.plane.normal);
      if (test.side == ShadowSide::outside) {
        EXPECT_EQ(alone, 0.0) << trial;
      } else if (test.side == ShadowSide::inside) {
        EXPECT_EQ(alone, 1.0) << trial;
      } else {
        EXPECT_NEAR(shadow.hidden_share(source, *cone, test.cuts, point, normal), alone, 0.01);
      }
    }
    EXPECT_NEAR(found, exact, 0.01) << trial;
    if (exact < 1e-12) {
      EXPECT_EQ(found, 0.0);
    }
    if (exact > 1.0 - 1e-12) {
      EXPECT_EQ(found, 1.0) << "nothing visible is exactly hidden";
    }
    partly += exact > 0.01 && exact < 0.99;
  }
  EXPECT_GT(partly, 50);
}

// The tall block of the Cornell Box between floor and left wall, mm: corners of the wall lie in the
// floor's plane and edges of the block stand on it. The shadow that such a corner casts along the
// floor is a line that cells must not cross; where they did, 7e-7 went missing under a bound of
// 1e-9.
TEST(VisibleExchange, KeepsItsBoundWhereSourceAndBlockStandOnTheReceiver) {
  const PlanarPolygon floor(Polygon{{552.8, 0, 0}, {0, 0, 0}, {0, 0, 559.2}, {549.6, 0, 559.2}});
  const PlanarPolygon wall(Polygon{{552.8, 0, 0}, {549.6, 0, 559.2}, {556, 548.8, 0}});
  const Vec3 foot[] = {{423, 0, 247}, {472, 0, 406}, {314, 0, 456}, {265, 0, 296}};
  const Vec3 up(0, 330, 0);
  std::vector<Blocker> faces;
  const auto add = [&](const Polygon& p) { faces.push_back({p, plane_of(p)}); };
  add({foot[0] + up, foot[3] + up, foot[2] + up, foot[1] + up});
  for (int k = 0; k < 4; ++k) {
    const Vec3 &a = foot[k], &b = foot[(k + 1) % 4];
    add({a, a + up, b + up, b});
  }
  const auto solids = convex_occluders(faces, 1e-9);
  ASSERT_EQ(solids.size(), 1u);
  const ConvexOccluder* const solid[] = {&solids[0]};
  std::vector<const Blocker*> polygons;
  for (const Blocker& face : faces) polygons.push_back(&face);
  const auto seen = [&](double tolerance) {
    ExactVisibilityOptions options;
    options.relative_tolerance = tolerance;
    return *visible_exchange(floor, wall, solid, options);
  };
  const VisibleExchange fine = seen(1e-11);
  ASSERT_TRUE(fine.converged);
  ASSERT_GT(fine.exchange_area_m2, 0.05 * floor.area_m2);
  for (double tolerance : {1e-5, 1e-6, 1e-7, 1e-8, 1e-9}) {
    const VisibleExchange rough = seen(tolerance);
    EXPECT_NEAR(rough.exchange_area_m2, fine.exchange_area_m2,
                rough.error_bound_m2 + fine.error_bound_m2)
        << tolerance;
  }
  ExactVisibilityOptions options;
  options.relative_tolerance = 1e-8;
  const VisibleExchange behind_faces = visible_exchange(floor, wall, polygons, options);
  EXPECT_NEAR(behind_faces.exchange_area_m2, fine.exchange_area_m2,
              behind_faces.error_bound_m2 + fine.error_bound_m2);
}

// Eight points of a square at the origin, looking up.
LanePoints eight_points(double edge) {
  LanePoints points{};
  for (std::size_t l = 0; l < kShadowLanes; ++l) {
    points.x[l] = edge * static_cast<double>(l % 4) / 3.0;
    points.y[l] = edge * static_cast<double>(l / 4);
    points.weight_m2[l] = edge * edge / 8.0;
  }
  return points;
}

class ShadowLanes : public testing::TestWithParam<int> {};  // corners of the source

TEST_P(ShadowLanes, HideWhatExactPartsDo) {
  // Behind one block or two that overlap, point by point, against the polygons that cones cut. Both
  // take kernels at centroids, one of hidden parts, the other of their pieces: equal to second
  // order in size over distance, (0.25 / 2)^2 / 2.
  const int corners = GetParam();
  Polygon polygon;
  for (int k = 0; k < corners; ++k) {
    const double phi = -2.0 * std::numbers::pi * k / corners;
    polygon.push_back({0.12 * std::cos(phi), 0.12 * std::sin(phi), 2.0});
  }
  const PlanarPolygon source(polygon);
  ASSERT_TRUE(FlatSource::fits(source));
  const FlatSource flat(source);
  const LanePoints points = eight_points(0.1);
  const Vec3 normal = Vec3::UnitZ();
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform(-0.15, 0.15);
  ShadowParts parts;
  int partly = 0, dark = 0;
  for (int trial = 0; trial < 400; ++trial) {
    std::vector<ConvexOccluder> solids;
    std::vector<LaneShadow> lanes(1 + trial % 2);
    for (std::size_t k = 0; k < lanes.size(); ++k) {
      const Vec3 low(uniform(random), uniform(random), 0.7 + uniform(random));
      const Vec3 size = Vec3(0.16, 0.16, 0.3) + Vec3(uniform(random), uniform(random), 0.0);
      solids.push_back(convex_occluders(box_faces(low, low + size), 1e-12)[0]);
      ASSERT_TRUE(lanes[k].make(points, normal, solids[k], 1e-12));
    }
    std::vector<const LaneShadow*> shadows;
    for (const LaneShadow& shadow : lanes) shadows.push_back(&shadow);
    LaneShares found;
    ASSERT_TRUE(hidden_shares(points, normal, source, flat, shadows, found));
    for (std::size_t l = 0; l < kShadowLanes; ++l) {
      const Vec3 x(points.x[l], points.y[l], points.z[l]);
      std::vector<ShadowCone> cones(solids.size());
      std::vector<const ShadowCone*> active;
      for (std::size_t k = 0; k < solids.size(); ++k)
        if (ShadowCone::make(x, normal, solids[k], 1e-12, cones[k]) == ShadowCone::Hides::region)
          active.push_back(&cones[k]);
      ASSERT_TRUE(parts.cut(source.vertices, active));
      const double exact = parts.hidden_share(x, normal, source.plane.normal);
      EXPECT_NEAR(found.hidden[l], exact, 0.008) << trial << ' ' << l;
      EXPECT_EQ(found.hidden[l] == 0.0, exact < 1e-12) << trial << ' ' << l << ' ' << exact;
      partly += exact > 0.01 && exact < 0.99;
      dark += exact == 1.0;
    }
  }
  EXPECT_GT(partly, 300);
  EXPECT_GT(dark, 20);
}

INSTANTIATE_TEST_SUITE_P(Corners, ShadowLanes, testing::Values(3, 4, 5, 8));

TEST(ShadowLanes, CountLinesThatCoincideOnce) {
  // A patch under a block, cut along its foot: on the floor the outline of the block and the planes
  // of its faces are the same lines, the patch's own edge.
  const auto block = convex_occluders(box_faces({0.0, 0.0, 0.0}, {0.2, 0.2, 0.3}), 1e-12);
  const PlanarPolygon under(Polygon{{0, 0, 0}, {0.1, 0, 0}, {0.1, 0.1, 0}, {0, 0.1, 0}});
  LanePoints points{};
  for (std::size_t l = 0; l < kShadowLanes; ++l) {
    points.x[l] = -1.0;
    points.y[l] = -1.0 + 0.2 * static_cast<double>(l);
    points.z[l] = 0.9;
  }
  LaneShadow shadow;
  const LaneShadow* const shadows[] = {&shadow};
  LaneShares found;
  ASSERT_TRUE(shadow.make(points, Vec3::UnitX(), block[0], 1e-9));
  ASSERT_TRUE(hidden_shares(points, Vec3::UnitX(), under, FlatSource(under), shadows, found));
  for (double hidden : found.hidden) EXPECT_NEAR(hidden, 1.0, 1e-6);
}

}  // namespace
}  // namespace truebox

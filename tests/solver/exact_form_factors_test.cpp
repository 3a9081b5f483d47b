// SPDX-License-Identifier: BSD-3-Clause
#include "transport/exact_form_factors.h"

#include <gmock/gmock.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>
#include <numeric>
#include <random>
#include <stdexcept>

#include "radiometry/table_file.h"
#include "scene/scene_file.h"
#include "support/brute_force_rows.h"
#include "support/tiny_scenes.h"
#include "transport/exact_visibility.h"
#include "transport/pair_kernel.h"
#include "transport/shadow_cones.h"
#include "transport/shadow_lanes.h"

namespace truebox {
namespace {

ExactFormFactorOptions with_points(int points, double tolerance = 1e-5) {
  ExactFormFactorOptions options;
  options.outline_points = points;
  options.relative_tolerance = tolerance;
  return options;
}

TEST(ExactFormFactors, CloseAnEmptyCubeToTheKernelsTolerance) {
  const Scene cube = tiny::cube(1.0, 0.0);
  const PatchMesh mesh = uniform_mesh(cube, 0.125);
  for (double tolerance : {1e-3, 1e-5, 1e-8}) {
    const auto f = exact_form_factors<double>(mesh, cube, with_points(3, tolerance));
    EXPECT_EQ(f.pairs_partial, 0u);
    EXPECT_LT(f.closure_rms(), tolerance);
  }
}

TEST(ExactFormFactors, CloseARoomWithABlock) {
  // Tolerance of adaptive visibility; each row has some hundred pairs whose errors partly cancel.
  const Scene scene = tiny::cube_with_block(1.0, 0.0);
  const PatchMesh mesh = uniform_mesh(scene, 0.2);
  const auto adaptive = exact_form_factors<double>(mesh, scene, with_points(0, 1e-6));
  EXPECT_GT(adaptive.pairs_partial, 100u);
  EXPECT_GT(adaptive.pairs_hidden, 100u);
  EXPECT_LT(adaptive.closure_rms(), 1e-6);
  double previous = 1.0;
  for (int points : {2, 3, 4}) {
    const double rms = exact_form_factors<double>(mesh, scene, with_points(points)).closure_rms();
    EXPECT_LT(rms, previous) << "more points, better";
    EXPECT_LT(rms, 5e-3) << points;
    previous = rms;
  }
}

TEST(ExactFormFactors, SeeBothSidesOfASheetHide) {
  // Both sides share all edges, in one plane: no solid, or light would pass. Where a sheet hides
  // nothing rows sum to more than one, by what it takes up of their view.
  Scene scene = tiny::cube(1.0, 0.0);
  const Polygon sheet{{0.3, 0.2, 0.4}, {0.8, 0.2, 0.4}, {0.8, 0.8, 0.4}, {0.3, 0.8, 0.4}};
  scene.surfaces.push_back(
      {"sheet", 0, {sheet, Polygon(sheet.rbegin(), sheet.rend())}, false, true});
  const PatchMesh mesh = uniform_mesh(scene, 0.2);
  const auto f = exact_form_factors<double>(mesh, scene, with_points(0, 1e-6));
  EXPECT_GT(f.pairs_partial, 100u);
  EXPECT_LT(f.closure_rms(), 1e-6);
}

TEST(ExactFormFactors, AgreeWithBruteForceRowByRow) {
  // Brute force finds a shadow's edge to some 1/16^1.5, and a tenth of the row is partly hidden:
  // 2e-3. Nine points a pair are worse by (16/3)^1.5 at most.
  const Scene scene = tiny::cube_with_block(1.0, 0.0);
  const PatchMesh mesh = uniform_mesh(scene, 0.25);
  const std::vector<PlanarPolygon> patches = planar_polygons(mesh);
  const auto adaptive = exact_form_factors<double>(mesh, scene, with_points(0, 1e-6));
  const auto quick = exact_form_factors<double>(mesh, scene, with_points(3));
  for (std::uint32_t i : {0u, 9u, 40u, 77u, 90u}) {
    EXPECT_LT(row_difference(mesh, patches, adaptive.exchange_area_m2, i), 2e-3) << i;
    EXPECT_LT(row_difference(mesh, patches, quick.exchange_area_m2, i), 2e-2) << i;
  }
}

TEST(ExactFormFactors, CloseTheRoomWithTwoBlocksToABillionth) {
  // The closed box cut into 223 patches: rows must sum to 1 to the tolerance asked for, whichever
  // blocks meet in front of each other. A row has some 100 partly hidden pairs, each allowed a
  // tenth of the tolerance: ten times the tolerance at most.
  const Scene scene =
      read_scene(std::string(TRUEBOX_REFERENCE_DIR) + "/independent_renders/closed_box.toml");
  const PatchMesh mesh = uniform_mesh(scene, edge_for_count(scene, 200));
  std::vector<double> off;
  std::mutex lock;
  // Rows of the floor between the blocks and of the wall behind them.
  for (std::size_t begin : {32u, 157u})
    stream_form_factors(
        mesh, scene, with_points(0, 1e-9), begin, begin + 6, [&](const FormFactorRow& row) {
          const std::lock_guard guard(lock);
          const double sum =
              std::accumulate(row.exchange_area_m2.begin(), row.exchange_area_m2.end(), 0.0) /
              mesh.patches[row.patch].area_m2;
          if (sum > 1e-4) off.push_back(std::abs(sum - 1.0));  // not buried
        });
  ASSERT_GE(off.size(), 8u);
  double squares = 0.0;
  for (double error : off) squares += error * error;
  EXPECT_LT(std::sqrt(squares / static_cast<double>(off.size())), 1e-9);
  EXPECT_LT(*std::max_element(off.begin(), off.end()), 1e-8);
}

TEST(ExactFormFactors, FloatsCostTheirRounding) {
  const Scene scene = tiny::cube_with_block(1.0, 0.0);
  const PatchMesh mesh = uniform_mesh(scene, 0.3);
  const auto in_double = exact_form_factors<double>(mesh, scene, with_points(3));
  const auto in_float = exact_form_factors<float>(mesh, scene, with_points(3));
  const auto n = in_double.area_m2.size();
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j) {
      const double value = in_double.exchange_area_m2(i, j);
      EXPECT_NEAR(in_float.exchange_area_m2(i, j), value, 6e-8 * value);
      EXPECT_EQ(value, in_double.exchange_area_m2(j, i));
    }
}

TEST(ExactFormFactors, StreamTheRowsOfTheMatrix) {
  const Scene scene = tiny::cube_with_block(1.0, 0.0);
  const PatchMesh mesh = uniform_mesh(scene, 0.25);
  const auto matrix = exact_form_factors<double>(mesh, scene, with_points(3));
  std::mutex lock;
  std::size_t rows = 0;
  stream_form_factors(mesh, scene, with_points(3), [&](std::size_t i, auto row) {
    const std::lock_guard guard(lock);
    ++rows;
    for (std::size_t j = 0; j < row.size(); ++j) {
      const double value =
          matrix.exchange_area_m2(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      EXPECT_EQ(row[j], value) << i << ' ' << j;
    }
  });
  EXPECT_EQ(rows, mesh.size());
}

TEST(ExactFormFactors, RefuseWhatDoesNotFitTheMemory) {
  const Scene cube = tiny::cube(1.0, 0.0);
  const PatchMesh mesh = uniform_mesh(cube, 0.1);  // 600 patches: 2.7 MiB in doubles
  const std::size_t limit = std::size_t{2} << 20;
  EXPECT_THROW(exact_form_factors<double>(mesh, cube, {}, limit), std::length_error);
  EXPECT_NO_THROW(exact_form_factors<float>(mesh, cube, {}, limit));
}

TEST(PairKernel, HoldsItsTolerance) {
  // Every pair of a cube's patches, near and far, against the closed form.
  const Scene cube = tiny::cube(1.0, 0.0);
  const PatchMesh mesh = uniform_mesh(cube, 0.2);
  const std::vector<PlanarPolygon> patches = planar_polygons(mesh);
  std::vector<std::uint32_t> order(patches.size());
  std::iota(order.begin(), order.end(), 0u);
  for (double tolerance : {1e-2, 1e-4, 1e-7}) {
    const PairKernel kernel(patches, order, tolerance, 1e-12);
    for (std::uint32_t i = 0; i < patches.size(); i += 3)
      for (std::uint32_t j = 0; j < patches.size(); ++j) {
        if (mesh.patches[i].piece == mesh.patches[j].piece) continue;
        const double exact = exchange_area_m2(patches[i], patches[j], 1e-13);
        EXPECT_NEAR(kernel.exchange_area_m2(i, j), exact, tolerance * exact) << i << ' ' << j;
      }
  }
}

TEST(PairKernel, FindsTheSameBitsOneByOneAndInRuns) {
  // The other walls' patches in runs of a length that eight does not divide, from below and above.
  const Scene cube = tiny::cube(1.0, 0.0);
  const PatchMesh mesh = uniform_mesh(cube, 0.21);
  const std::vector<PlanarPolygon> patches = planar_polygons(mesh);
  std::vector<std::uint32_t> order(patches.size());
  std::iota(order.begin(), order.end(), 0u);
  for (double tolerance : {1e-2, 1e-4, 1e-7}) {
    const PairKernel kernel(patches, order, tolerance, 1e-12);
    for (std::uint32_t i = 0; i < patches.size(); i += 7)
      for (std::size_t p = 0; p < mesh.pieces.size(); ++p) {
        if (p == mesh.patches[i].piece) continue;
        const Piece& piece = mesh.pieces[p];
        std::vector<double> run(piece.patch_count - 1);
        kernel.exchange_areas_m2(i, piece.first_patch, true, run);
        for (std::uint32_t k = 0; k < run.size(); ++k)
          EXPECT_EQ(run[k], kernel.exchange_area_m2(i, piece.first_patch + k)) << i << ' ' << k;
      }
  }
}

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

// A closed cube's factors with multiplicative noise, and its radiosity.
struct NoisyCube {
  Eigen::MatrixXd exact, noisy;
  Eigen::VectorXd area;
  std::vector<std::vector<std::uint32_t>> entries;
  std::vector<char> usable;

  explicit NoisyCube(double deviation) {
    const Scene cube = tiny::cube(1.0, 0.0);
    const PatchMesh mesh = uniform_mesh(cube, 0.25);
    auto f = exact_form_factors<double>(mesh, cube, with_points(3, 1e-10));
    exact = f.exchange_area_m2;
    area = f.area_m2;
    usable = f.usable;
    draw(deviation, 11);
  }

  void draw(double deviation, unsigned seed) {
    noisy = exact;
    entries.assign(usable.size(), {});
    std::mt19937_64 random(seed);
    std::normal_distribution<double> gauss(1.0, deviation);
    for (Eigen::Index i = 0; i < exact.rows(); ++i)
      for (Eigen::Index j = i + 1; j < exact.rows(); ++j) {
        if (exact(j, i) == 0.0) continue;
        noisy(j, i) = noisy(i, j) = exact(j, i) * std::max(0.0, gauss(random));
        entries[static_cast<std::size_t>(i)].push_back(static_cast<std::uint32_t>(j));
      }
  }

  // Relative L1 error of B = E + rho F B, E = 1 on every third patch.
  double radiosity_error(const Eigen::MatrixXd& exchange, double rho) const {
    const auto solve = [&](const Eigen::MatrixXd& s) -> Eigen::VectorXd {
      const auto n = area.size();
      Eigen::VectorXd source = Eigen::VectorXd::Zero(n);
      for (Eigen::Index i = 0; i < n; i += 3) source[i] = 1.0;
      Eigen::MatrixXd system = -rho * s;
      system.diagonal() += area;
      return system.partialPivLu().solve(area.cwiseProduct(source));
    };
    const Eigen::VectorXd truth = solve(exact);
    return (solve(exchange) - truth).lpNorm<1>() / truth.lpNorm<1>();
  }
};

class EveryRepair : public testing::TestWithParam<ClosureRepair> {};

TEST_P(EveryRepair, ClosesSymmetricallyAndSaysByHowMuch) {
  const NoisyCube cube(0.05);
  Eigen::MatrixXd s = cube.noisy;
  const ClosureReport report = repair_closure(s, cube.area, cube.usable, cube.entries, GetParam());
  for (Eigen::Index i = 0; i < s.rows(); ++i)
    EXPECT_NEAR(s.col(i).sum() / cube.area[i], 1.0, 1e-10);
  EXPECT_EQ((s - s.transpose()).cwiseAbs().maxCoeff(), 0.0);
  EXPECT_GE(s.minCoeff(), 0.0);
  EXPECT_EQ(report.negative, 0u);
  EXPECT_LT(report.error_after_max, 1e-10);
  // 80 entries a row with 5 % noise each, weights unequal: rows are off by about 0.05 / sqrt(80).
  EXPECT_GT(report.error_before_rms, 0.002);
  EXPECT_LT(report.error_before_rms, 0.02);
  EXPECT_GT(report.change_rms, 0.001);
  EXPECT_LT(report.change_max, 0.2);
  EXPECT_THAT(report.brief(), testing::HasSubstr("entries changed by"));
}

TEST_P(EveryRepair, LeavesWhatIsNotSampledAndWhatCannotBeMended) {
  NoisyCube cube(0.05);
  cube.entries[5].clear();  // of row 5 only entries with smaller indices stay open
  for (std::uint32_t i = 0; i < 5; ++i) std::erase(cube.entries[i], 5u);
  Eigen::MatrixXd s = cube.noisy;
  const ClosureReport report = repair_closure(s, cube.area, cube.usable, cube.entries, GetParam());
  EXPECT_EQ(report.rows_left_alone, 1u);
  EXPECT_EQ((s.col(5) - cube.noisy.col(5)).cwiseAbs().maxCoeff(), 0.0);
  EXPECT_GT(report.error_after_max, 1e-5) << "a row that cannot be mended is reported, not hidden";
}

INSTANTIATE_TEST_SUITE_P(Methods, EveryRepair,
                         testing::Values(ClosureRepair::scaling, ClosureRepair::least_squares),
                         [](const auto& method) {
                           return method.param == ClosureRepair::scaling ? "scaling"
                                                                         : "least_squares";
                         });

// The column "rel L1 error of B" of closure_repair.csv.
class RepairTable {
 public:
  double error(double deviation, const std::string& rho, const std::string& repair) const {
    const std::size_t column = table_.column_index("rel L1 error of B rho=" + rho);
    for (std::size_t row = 0; row < table_.rows.size(); ++row)
      if (table_.number(row, 0) == deviation && table_.rows[row][1] == repair)
        return table_.number(row, column);
    throw std::out_of_range(repair);
  }

 private:
  TableFile table_ =
      read_table(std::string(TRUEBOX_REFERENCE_DIR) + "/analytic/closure_repair.csv");
};

TEST(ClosureRepair, GainsAtLeastWhatTheIndependentTableSays) {
  // The table's enclosure is another one and its noise a single draw; what must hold in any: repair
  // gains over symmetric, unrepaired factors, more so the whiter the walls, what is left grows with
  // the noise, and the weighted fit is no worse than scaling. Medians of five draws; a factor 2 for
  // the table's single one.
  const std::string scaling = "Sinkhorn symmetric scaling";
  const std::string fit = "LS weighted by F^2 (Taylor-Luck type)";
  const RepairTable table;
  NoisyCube cube(0.0);
  for (const auto& [rho, name] : {std::pair{0.5, "0.5"}, {0.9, "0.9"}, {0.99, "0.99"}}) {
    std::vector<double> left;
    for (double deviation : {0.01, 0.05, 0.2}) {
      std::vector<double> none, by_scaling, by_fit;
      for (unsigned seed = 11; seed < 16; ++seed) {
        cube.draw(deviation, seed);
        Eigen::MatrixXd scaled = cube.noisy, fitted = cube.noisy;
        repair_closure(scaled, cube.area, cube.usable, cube.entries, ClosureRepair::scaling);
        repair_closure(fitted, cube.area, cube.usable, cube.entries, ClosureRepair::least_squares);
        none.push_back(cube.radiosity_error(cube.noisy, rho));
        by_scaling.push_back(cube.radiosity_error(scaled, rho));
        by_fit.push_back(cube.radiosity_error(fitted, rho));
      }
      for (auto* of : {&none, &by_scaling, &by_fit}) std::sort(of->begin(), of->end());
      const double unrepaired = table.error(deviation, name, "symmetrise only");
      EXPECT_GT(none[2] / by_scaling[2], 0.5 * unrepaired / table.error(deviation, name, scaling))
          << deviation << ' ' << rho;
      EXPECT_GT(none[2] / by_fit[2], 0.5 * unrepaired / table.error(deviation, name, fit))
          << deviation << ' ' << rho;
      EXPECT_LT(by_fit[2], 1.05 * by_scaling[2]) << deviation << ' ' << rho;
      left.push_back(by_scaling[2] / deviation);
    }
    // Proportional to the noise within the spread of medians; the table's draws: a factor 1.4.
    EXPECT_LT(*std::max_element(left.begin(), left.end()),
              2.0 * *std::min_element(left.begin(), left.end()))
        << rho;
  }
}

}  // namespace
}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <random>

#include "planning/field_error.h"
#include "planning/full_model.h"
#include "planning/line_pilot.h"
#include "planning/plan.h"
#include "scene/generated_scene.h"
#include "scene/scene_file.h"
#include "support/penumbra_scene.h"
#include "support/scratch.h"
#include "support/tiny_scenes.h"
#include "transport/enclosure.h"
#include "transport/polynomial_means.h"
#include "transport/predict_to_target.h"

namespace truebox {
namespace {

Scene cornell_box() {
  return read_scene(std::string(TRUEBOX_REFERENCE_DIR) + "/cornell_box/cornell_box.toml");
}

// Convex, grey in seven bands, one face shines with another spectrum: all bands are multiples.
Scene convex_grey_room() {
  Scene room = tiny::cube(1.0, 0.5);
  room.bands = WavelengthGrid::uniform(400, 700, 50);
  room.materials = {
      {"grey", Reflectance(7, 0.5), RadiantExitance(7, 0.0)},
      {"lamp", Reflectance(7, 0.5), RadiantExitance(std::vector<double>{1, 2, 3, 4, 5, 6, 0.5})}};
  room.surfaces[1].material = 1;
  return room;
}

PlanRequest target(double error) {
  PlanRequest request;
  request.target_error = error;
  return request;
}

const Decision& decision(const Plan& plan, const std::string& topic) {
  for (const Decision& d : plan.decisions)
    if (d.topic == topic) return d;
  throw std::runtime_error("no decision about " + topic);
}

TEST(MutualVisibility, OfAConvexRoomIsFullBetweenAllFaces) {
  const MutualVisibility sees(tiny::cube(1.0, 0.5));
  ASSERT_TRUE(sees.is_complete());
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t j = 0; j < 6; ++j)
      EXPECT_EQ(sees.between(i, j), i == j ? Sight::none : Sight::full);
  EXPECT_EQ(sees.shares().full, 15u);
}

TEST(MutualVisibility, KnowsBacksAndOneWallThatHidesAll) {
  Scene scene = tiny::grey_scene(0.5);
  const Polygon floor = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  Polygon ceiling = {{0, 0, 2}, {0, 1, 2}, {1, 1, 2}, {1, 0, 2}};
  tiny::add_surface(scene, "floor", floor);
  tiny::add_surface(scene, "ceiling", ceiling);
  tiny::add_surface(scene, "roof", {{0, 0, 3}, {1, 0, 3}, {1, 1, 3}, {0, 1, 3}});
  EXPECT_EQ(MutualVisibility(scene).between(0, 1), Sight::full);
  EXPECT_EQ(MutualVisibility(scene).between(0, 2), Sight::none) << "the roof turns its back";
  Scene halved = scene;
  tiny::add_surface(halved, "shelf", {{0, 0, 1}, {0.5, 0, 1}, {0.5, 1, 1}, {0, 1, 1}});
  EXPECT_EQ(MutualVisibility(halved).between(0, 1), Sight::partial);
  EXPECT_EQ(MutualVisibility(halved).between(1, 3), Sight::full);
  tiny::add_surface(scene, "screen", {{-1, -1, 1}, {2, -1, 1}, {2, 2, 1}, {-1, 2, 1}});
  EXPECT_EQ(MutualVisibility(scene).between(0, 1), Sight::none);
}

// Rays between random points of two surfaces: those that reach, of those whose ends face each
// other.
struct Rays {
  int traced = 0, reached = 0;
};
Rays rays_between(const Scene& scene, const Visibility& visibility, std::size_t i, std::size_t j,
                  std::mt19937_64& random) {
  Rays rays;
  const auto point_of = [&](const Surface& s, Vec3& normal) {
    const Polygon& piece = s.pieces[random() % s.pieces.size()];
    normal = plane_of(piece).normal;
    return sample_polygon(piece, unit_interval(random()), unit_interval(random()));
  };
  for (int k = 0; k < 100; ++k) {
    Vec3 from_normal, to_normal;
    const Vec3 from = point_of(scene.surfaces[i], from_normal);
    const Vec3 to = point_of(scene.surfaces[j], to_normal);
    if (from_normal.dot(to - from) <= 1e-9 || to_normal.dot(from - to) <= 1e-9) continue;
    ++rays.traced;
    rays.reached += !visibility.occluded(from, from_normal, to, to_normal);
  }
  return rays;
}

TEST(MutualVisibility, IsWhatRaysFindInTheCornellBox) {
  const Scene scene = cornell_box();
  const MutualVisibility sees(scene);
  const PatchMesh mesh = uniform_mesh(scene, edge_for_count(scene, 20));
  const Visibility visibility(mesh, scene);
  std::mt19937_64 random(3);
  int certain = 0, partial = 0, mixed = 0;
  for (std::size_t i = 0; i < scene.surfaces.size(); ++i)
    for (std::size_t j = i + 1; j < scene.surfaces.size(); ++j) {
      if (scene.surfaces[i].is_opening || scene.surfaces[j].is_opening) continue;
      const Rays rays = rays_between(scene, visibility, i, j, random);
      const std::string pair = scene.surfaces[i].name + ", " + scene.surfaces[j].name;
      switch (sees.between(i, j)) {
        case Sight::full: EXPECT_EQ(rays.reached, rays.traced) << pair; break;
        case Sight::none: EXPECT_EQ(rays.reached, 0) << pair; break;
        case Sight::partial:
          ++partial;
          mixed += rays.reached < rays.traced && rays.reached > 0;
          continue;
      }
      certain += rays.traced > 0;
    }
  EXPECT_GT(certain, 30) << "pairs decided without a ray";
  EXPECT_GT(mixed, partial / 2) << "what is called partial mostly is";
}

TEST(MutualVisibility, OfManyPiecesIsEstimatedBySampling) {
  const Scene scene = cornell_box();
  const MutualVisibility all(scene), sampled(scene, 3, 4000);
  EXPECT_FALSE(sampled.is_complete());
  EXPECT_EQ(sampled.shares().pairs, 4000u);
  const double p = all.shares().share(all.shares().full);
  EXPECT_NEAR(sampled.shares().share(sampled.shares().full), p,
              4.0 * std::sqrt(p * (1.0 - p) / 4000.0));
}

TEST(Plan, OfAConvexGreyRoomPaysForNothingItDoesNotNeed) {
  const Scene room = convex_grey_room();
  const Plan plan = make_plan(room, target(0.02));
  EXPECT_EQ(plan.method, PlannedMethod::radiosity);
  EXPECT_EQ(plan.exchange, PlannedExchange::full_matrix);
  EXPECT_EQ(decision(plan, "occlusion").choice, "left out");
  EXPECT_EQ(decision(plan, "form factors").choice, "analytic");
  EXPECT_LE(plan.bands_solved, 1u);
  EXPECT_GE(decision(plan, "bands").saving(), 7.0);
  const auto claims = check_claims(room, plan, 400);
  ASSERT_EQ(claims.size(), 4u);
  for (const ClaimCheck& claim : claims) {
    EXPECT_TRUE(claim.holds()) << claim.claim << ": " << claim.difference << " > " << claim.allowed;
    EXPECT_LT(claim.planned_work, claim.full_work) << claim.claim;
  }
  EXPECT_EQ(claims.front().planned_work, 0.0) << "rays";
  EXPECT_GT(claims.front().full_work, 5e5) << "rays of a model that tests every pair";
  EXPECT_GT(claims.back().full_s, 2.0 * claims.back().planned_s);
}

TEST(Plan, SaysThatAFalseClaimDoesNotHold) {
  const Scene room = tiny::cube_with_block(1.0, 0.5, 1.0);
  Plan plan = make_plan(room, target(0.05));
  plan.needs.occlusion = false;  // it does have a block
  const auto claims = check_claims(room, plan, 300);
  EXPECT_FALSE(claims.front().holds()) << claims.front().difference;
}

TEST(Plan, LeavesInterreflectionOutWhereNothingReflects) {
  Scene room = tiny::cube_with_block(1.0, 0.0, 0.0);
  room.materials.push_back({"lamp", Reflectance(1, 0.0), RadiantExitance(1, 1.0)});
  room.surfaces[1].material = 1;
  const Plan plan = make_plan(room, target(0.01));
  EXPECT_EQ(plan.method, PlannedMethod::direct_light);
  EXPECT_TRUE(std::isinf(decision(plan, "interreflection").saving()));
  const auto claims = check_claims(room, plan, 300);
  ASSERT_FALSE(claims.empty());
  for (const ClaimCheck& claim : claims) EXPECT_TRUE(claim.holds()) << claim.difference;
}

TEST(Plan, FollowsLinesOfLightOnlyWhereInterpolationGainsByThem) {
  tiny::PenumbraScene shadow;
  Scene scene = shadow.scene();
  tiny::add_surface(scene, "wall", {{-2, -2, 0}, {-2, 2, 0}, {-2, 2, 2}, {-2, -2, 2}});  // indirect
  PlanRequest request = target(0.1);
  Plan plan = make_plan(scene, request);
  EXPECT_FALSE(plan.discontinuities);  // nobody interpolates
  EXPECT_EQ(decision(plan, "lines of light").error_kind, ErrorKind::none);
  request.interpolated = true;
  plan = make_plan(scene, request);
  EXPECT_TRUE(plan.discontinuities);
  const LinePilot pilot = fly_line_pilot(scene, 1600, nullptr);
  std::printf("direct light interpolated: %.3g without lines (%zu), %.3g along %zu lines (%zu)\n",
              pilot.error, pilot.elements, pilot.error_along, pilot.lines, pilot.elements_along);
  EXPECT_GE(pilot.lines, 8u);  // borders of umbra and penumbra
  EXPECT_LT(pilot.error_along, 0.8 * pilot.error);
}

TEST(Plan, FindsTheBandsOfFewMaterialsOnABasis) {
  const Scene box = cornell_box();
  const Plan plan = make_plan(box, target(0.2));
  EXPECT_LT(plan.bands_solved, box.bands.size());
  const auto claims = check_claims(box, plan, 300);
  ASSERT_GE(claims.size(), 2u);
  for (const ClaimCheck& claim : claims)
    EXPECT_TRUE(claim.holds()) << claim.claim << ": " << claim.difference << " > " << claim.allowed;
}

TEST(Plan, ForetellsTheElementsThatATargetTakes) {
  const Scene room = convex_grey_room();
  const Plan plan = make_plan(room, target(0.005));
  PredictOptions options;
  options.elements = plan.elements;
  options.form_factors.method = plan.form_factors;
  options.solve.relative_bound = plan.solver_bound;
  const TargetedPrediction met = predict_to_target(room, options, 0.005);
  EXPECT_TRUE(met.is_reached);
  EXPECT_LE(met.steps.size(), 2u) << "foretold: " << plan.elements;
  const double excess = met.steps.front().relative_bound / 0.005;
  EXPECT_GT(excess, 0.2) << "five times finer than needed";
}

TEST(Plan, StreamsRowsWhereAMatrixDoesNotFitAndTheyAreSoonMade) {
  PlanRequest request = target(0.02);
  request.memory_limit_bytes = 1 << 20;
  const Scene room = tiny::cube_with_block(1.0, 0.5, 1.0);
  const Plan plan = make_plan(room, request);
  EXPECT_EQ(plan.exchange, PlannedExchange::streamed);
  EXPECT_LT(plan.bytes, request.memory_limit_bytes);
  EXPECT_EQ(decision(plan, "exchange").error_kind, ErrorKind::none);
}

Scene closed_box() {
  return in_bands_at(
      read_scene(std::string(TRUEBOX_REFERENCE_DIR) + "/independent_renders/closed_box.toml"),
      {450.0, 550.0, 650.0});
}

PlanRequest rms_target(double error) {
  PlanRequest request = target(error);
  request.measure = ErrorMeasure::rms_irradiance;
  request.goal = Goal{Goal::Kind::irradiance, {}, 0, 0};
  return request;
}

// Uniform elements: from a matrix of some 5500 on (tests/benchmark/links_or_matrix.cpp). Adapted
// ones with a matrix may still be sooner than both; on a busy machine, too.
TEST(Plan, OfRmsIrradianceTakesLinksOrAdaptsWhereAUniformMatrixTakesLonger) {
  const Scene box = in_bands_at(closed_box(), {550.0});
  const Plan coarse = make_plan(box, rms_target(0.02));
  EXPECT_EQ(coarse.exchange, PlannedExchange::full_matrix);
  EXPECT_NE(decision(coarse, "exchange").why.find("links take longer below"), std::string::npos);
  Plan plan = make_plan(box, rms_target(0.002));
  EXPECT_TRUE(plan.exchange == PlannedExchange::hierarchical || plan.mesh == PlannedMesh::adapted);
  const Decision& exchange = decision(plan, "exchange");
  const std::string from = "links are sooner from ";
  const std::size_t at = exchange.why.find(from);
  ASSERT_NE(at, std::string::npos) << exchange.why;
  EXPECT_LT(std::stod(exchange.why.substr(at + from.size())), decision(plan, "mesh").full_work);
  if (plan.exchange == PlannedExchange::hierarchical) {
    EXPECT_NEAR(plan.link_tolerance, 0.002, 1e-9);
    EXPECT_EQ(exchange.error_kind, ErrorKind::estimate);
    EXPECT_GT(exchange.saving(), 2.0) << "memory";
  }
}

// Four fifths of the elements that a uniform mesh takes: adapted ones fit, or links.
TEST(Plan, MeetsTheTargetWithinAMemoryThatAUniformMatrixDoesNotFit) {
  const Scene box = in_bands_at(closed_box(), {550.0});
  PlanRequest request = rms_target(0.004);
  const double uniform = decision(make_plan(box, request), "mesh").full_work;
  ASSERT_GT(uniform, 2000.0);
  request.memory_limit_bytes = static_cast<std::size_t>(8.0 * std::pow(0.8 * uniform, 2));
  const Plan plan = make_plan(box, request);
  EXPECT_TRUE(plan.mesh == PlannedMesh::adapted || plan.exchange != PlannedExchange::full_matrix);
  EXPECT_LE(plan.bytes, request.memory_limit_bytes);
  EXPECT_LE(decision(plan, "mesh").error, 0.004);
}

const ClaimCheck& claim_of(const std::vector<ClaimCheck>& claims, const std::string& name) {
  for (const ClaimCheck& c : claims)
    if (c.claim == name) return c;
  throw std::runtime_error("no claim of " + name);
}

TEST(Plan, HoldsLinksToTheMatrixOfTheSameElements) {
  const Scene box = in_bands_at(closed_box(), {550.0});
  Plan plan;
  plan.needs = requirements(box);
  plan.exchange = PlannedExchange::hierarchical;
  plan.link_tolerance = 0.003;
  const auto claims = check_claims(box, plan, 500);
  const ClaimCheck& links = claim_of(claims, "links instead of a matrix");
  EXPECT_TRUE(links.holds()) << links.difference << " > " << links.allowed;
  EXPECT_GT(links.difference, 1e-4) << "links leave something out";
  EXPECT_LT(links.planned_work, links.full_work);
}

PlanRequest means_target(double error) {
  PlanRequest request = target(error);
  request.means_only = true;
  return request;
}

// A few dozen elements instead of more than fit the memory.
TEST(Plan, TakesPolynomialsForMeansInAConvexRoomAndHoldsThemToConstants) {
  const Scene room = convex_grey_room();
  const Plan plan = make_plan(room, means_target(1e-4));
  ASSERT_GE(plan.degree, 1);
  EXPECT_LT(plan.elements, 500u);
  EXPECT_GT(decision(plan, "basis").saving(), 20.0);
  EXPECT_EQ(decision(plan, "basis").error_kind, ErrorKind::bound);
  PolynomialOptions options;
  options.degree = plan.degree;
  options.elements = plan.elements;
  options.kernel_tolerance = kernel_tolerance_for(1e-4);
  const TargetedMeans met = polynomial_means_to_target(room, options, 1e-4);
  EXPECT_TRUE(met.is_reached);
  EXPECT_LE(met.steps.size(), 2u) << "foretold: " << plan.elements;
  const auto claims = check_claims(room, plan, 400);
  const ClaimCheck& basis = claim_of(claims, "polynomials, not constants");
  EXPECT_TRUE(basis.holds()) << basis.difference << " > " << basis.allowed;
  EXPECT_LT(basis.allowed, 0.02);
  EXPECT_LT(basis.planned_work, basis.full_work);
}

TEST(Plan, KeepsConstantsWherePolynomialsCannotServe) {
  const auto reason = [](const Scene& scene, const PlanRequest& request) {
    const Plan plan = make_plan(scene, request);
    EXPECT_EQ(plan.degree, 0);
    return decision(plan, "basis").why;
  };
  const auto says = [](const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
  };
  const Scene room = convex_grey_room();
  EXPECT_TRUE(says(reason(room, target(1e-3)), "values at points"));
  EXPECT_TRUE(says(reason(room, means_target(0.05)), "little to gain"));
  Scene blocked = tiny::cube_with_block(1.0, 0.5, 1.0);
  EXPECT_TRUE(says(reason(blocked, means_target(0.05)), "kinks at shadows"));
  Scene black = room;
  black.materials.push_back({"soot", Reflectance(7, 0.0), RadiantExitance(7, 0.0)});
  black.surfaces[0].material = 2;
  EXPECT_TRUE(says(reason(black, means_target(1e-3)), "reflects nothing"));
}

// Held to a solution of five times as many elements, which takes off most of the error.
TEST(FieldError, OfThreeGridsIsWhatTheFieldIsOffByToAFactorOfTwo) {
  Scene scene = tiny::cube_with_block(1.0, 0.7, 0.0);
  scene.materials.push_back({"lamp", Reflectance(1, 0.0), RadiantExitance(1, 1.0)});
  scene.surfaces[1].material = 1;
  PredictOptions options;
  options.near_sources = false;
  options.elements = 600;
  const Prediction coarse(scene, options);
  options.elements = 2400;
  const Prediction fine(scene, options);
  const PatchMesh& mesh = fine.fine().mesh;
  Gather::Scratch scratch;
  double squares = 0.0, area_m2 = 0.0, mean = 0.0;
  for (std::size_t i = 0; i < mesh.size(); ++i) {
    const Patch& patch = mesh.patches[i];
    if (!fine.fine().usable[i]) continue;
    const double truth = fine.irradiance_on(patch.piece, patch.centroid, scratch).value[0];
    const double off = coarse.irradiance_on(patch.piece, patch.centroid, scratch).value[0] - truth;
    squares += patch.area_m2 * off * off;
    mean += patch.area_m2 * truth;
    area_m2 += patch.area_m2;
  }
  const double error = std::sqrt(squares * area_m2) / mean, estimate = field_error(coarse);
  std::printf("field of %zu elements: off by %.3g, estimated %.3g\n", coarse.fine().mesh.size(),
              error, estimate);
  EXPECT_GT(estimate, 0.5 * error);
  EXPECT_LT(estimate, 2.0 * error);
}

TEST(Plan, TakesLinksWhereOnlyTheyFit) {
  const Scene museum = [] {
    GeneratedSceneOptions options;
    options.patches = 12000;
    const std::string path = scratch_path("museum.toml");
    std::ofstream(path) << generated_scene(options);
    return read_scene(path);
  }();
  PlanRequest request = target(0.02);
  request.memory_limit_bytes = std::size_t{100} << 20;
  const Plan plan = make_plan(museum, request);
  EXPECT_EQ(plan.exchange, PlannedExchange::hierarchical);
  EXPECT_FALSE(plan.pilot) << "too many pieces for a small solve";
  EXPECT_LE(plan.bytes, request.memory_limit_bytes);
  EXPECT_EQ(decision(plan, "exchange").error_kind, ErrorKind::estimate);
  EXPECT_GT(decision(plan, "exchange").saving(), 2.0);
}

TEST(Plan, TracesPathsOfAMirrorAsFewAsTheNoiseAllows) {
  Scene room = convex_grey_room();
  room.materials.push_back({"silver", Reflectance(7, 0.9), RadiantExitance(7, 0.0)});
  room.materials.back().scattering = Scattering::mirror;
  room.surfaces[0].material = 2;
  PlanRequest request = target(0.02);
  CameraDescription camera;
  camera.position_m = {0.5, 0.1, 0.5};
  camera.direction = {0, 1, 0};
  camera.up = {0, 0, 1};
  camera.focal_length_m = 0.02;
  camera.film_m = {0.024, 0.024};
  camera.pixels = {64, 64};
  request.camera = camera;
  const Plan plan = make_plan(room, request);
  EXPECT_EQ(plan.method, PlannedMethod::path_tracing);
  ASSERT_TRUE(plan.path_pilot);
  EXPECT_EQ(plan.paths % 16, 0);
  EXPECT_GT(plan.paths, 0);
  EXPECT_TRUE(check_claims(room, plan, 300).empty());
}

TEST(Plan, RefusesATargetThatIsNone) {
  EXPECT_THROW(make_plan(tiny::cube(1.0, 0.5, 1.0), target(0.0)), std::invalid_argument);
  EXPECT_THROW(make_plan(tiny::cube(1.0, 0.5, 1.0), target(1.0)), std::invalid_argument);
}

}  // namespace
}  // namespace truebox

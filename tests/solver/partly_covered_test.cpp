// SPDX-License-Identifier: BSD-3-Clause
// Elements that lie partly under another surface: a block sunk into the floor cuts no element along
// its outline, one that stands on it does. The light is the same.
#include <gtest/gtest.h>

#include "mesh/contact_lines.h"
#include "support/tiny_scenes.h"
#include "transport/prediction.h"
#include "transport/streamed_exchange.h"

namespace truebox {
namespace {

using Eigen::Index;

Scene room_with_block(double lowest_m, double rho, double exitance) {
  Scene scene = tiny::cube(1.0, rho, exitance);
  tiny::add_box(scene, "block", Vec3(0.31, 0.37, lowest_m), Vec3(0.58, 0.66, 0.43), false);
  return scene;
}

// Grey room, a lamp close below its ceiling.
Scene lit(double lowest_m) {
  Scene scene = room_with_block(lowest_m, 0.6, 0.0);
  scene.materials.push_back({"lamp", Reflectance(1, 0.0), RadiantExitance(1, 1.0)});
  tiny::add_box(scene, "lamp", Vec3(0.3, 0.3, 0.9), Vec3(0.7, 0.7, 0.95), false, 1);
  return scene;
}

enum class Way { outlines, rays, streamed };

std::size_t elements_of(Way way) { return way == Way::streamed ? 150 : 600; }  // it takes its time

std::unique_ptr<Prediction> solved(const Scene& scene, Way way, std::size_t elements = 800) {
  PredictOptions options;
  options.elements = elements;
  if (way == Way::rays) options.form_factors.method = FormFactorMethod::ray_casting;
  if (way == Way::streamed) {
    options.find_exchange = streamed_exchange;
    options.solve.share_bands = false;
  }
  return std::make_unique<Prediction>(scene, options);
}

struct Means {
  std::vector<double> area_m2, irradiance;  // of each surface, what is free of it
  double absorbed_W = 0.0;
};

Means means_of(const Prediction& p) {
  const Scene& scene = p.scene();
  Means means{std::vector<double>(scene.surfaces.size()), {}, 0.0};
  means.irradiance.resize(scene.surfaces.size());
  const BandMatrix irradiance = p.irradiance();
  for (std::size_t i = 0; i < p.fine().mesh.size(); ++i) {
    if (!p.fine().usable[i]) continue;
    const std::size_t s = p.fine().mesh.surface_of(p.fine().mesh.patches[i]);
    const double area = p.fine().free_area_m2[static_cast<Index>(i)];
    const double power = area * irradiance(static_cast<Index>(i), 0);
    means.area_m2[s] += area;
    means.irradiance[s] += power;
    means.absorbed_W += power * (1.0 - scene.material_of(scene.surfaces[s]).reflectance[0]);
  }
  for (std::size_t s = 0; s < means.area_m2.size(); ++s)
    if (means.area_m2[s] > 0.0) means.irradiance[s] /= means.area_m2[s];
  return means;
}

class PartlyCovered : public testing::TestWithParam<Way> {};

// rho = 1/2, M = 1: E = 2 on every element that is not wholly covered.
TEST_P(PartlyCovered, ElementsOfAFurnaceAreAsBrightAsWholeOnes) {
  const Scene scene = room_with_block(-0.07, 0.5, 1.0);
  const auto prediction = solved(scene, GetParam(), elements_of(GetParam()));
  ASSERT_GT(prediction->fine().form_factors.covered_patches, 5u);
  const BandMatrix irradiance = prediction->irradiance();
  // Rays scatter the rows of the cut elements' neighbours, which are scaled, and nothing else.
  double worst = 0.0;
  for (Index i = 0; i < irradiance.rows(); ++i)
    if (prediction->fine().usable[static_cast<std::size_t>(i)])
      worst = std::max(worst, std::abs(irradiance(i, 0) - 2.0));
  EXPECT_LT(worst, GetParam() == Way::rays ? 0.05 : 2e-3);
}

TEST_P(PartlyCovered, ElementsCountWithTheAreaThatIsFree) {
  const Means sunk =
      means_of(*solved(room_with_block(-0.07, 0.5, 1.0), GetParam(), elements_of(GetParam())));
  const double tolerance = GetParam() == Way::rays ? 0.02 : 2e-3;
  EXPECT_NEAR(sunk.area_m2[0], 1.0 - 0.27 * 0.29, tolerance);
  EXPECT_NEAR(sunk.area_m2[8], 0.27 * 0.43, tolerance) << "of a side, what is above the floor";
}

std::string name_of(const testing::TestParamInfo<Way>& info) {
  const char* const names[] = {"by_outlines", "by_rays", "streamed"};
  return names[static_cast<int>(info.param)];
}

INSTANTIATE_TEST_SUITE_P(Ways, PartlyCovered,
                         testing::Values(Way::outlines, Way::rays, Way::streamed), name_of);

TEST(PartlyCoveredElements, SunkenBlockLightsTheRoomAsOneThatStandsOnTheFloor) {
  const Scene sunk_scene = lit(-0.07), standing_scene = lit(0.0);
  const auto sunk_solution = solved(sunk_scene, Way::outlines);
  const auto standing_solution = solved(standing_scene, Way::outlines);
  ASSERT_GT(sunk_solution->fine().form_factors.covered_patches, 20u);
  ASSERT_EQ(standing_solution->fine().form_factors.covered_patches, 0u);
  const Means sunk = means_of(*sunk_solution), standing = means_of(*standing_solution);
  const BandMatrix bound = sunk_solution->surface_irradiance_bound(),
                   other = standing_solution->surface_irradiance_bound();
  for (std::size_t s = 0; s < standing.area_m2.size(); ++s) {
    if (standing.area_m2[s] == 0.0) continue;  // the block's underside
    const auto row = static_cast<Index>(s);
    EXPECT_NEAR(sunk.irradiance[s], standing.irradiance[s], bound(row, 0) + other(row, 0))
        << sunk_scene.surfaces[s].name;
    EXPECT_NEAR(sunk.irradiance[s], standing.irradiance[s], 0.01 * standing.irradiance[s])
        << sunk_scene.surfaces[s].name;
  }
  const double emitted_W = 2 * 0.4 * 0.4 + 4 * 0.4 * 0.05;
  EXPECT_NEAR(standing.absorbed_W, emitted_W, 2e-3 * emitted_W);
  EXPECT_NEAR(sunk.absorbed_W, emitted_W, 2e-3 * emitted_W);
}

// The same with a wall taken away, where rows do not tell what is free of an element.
class PartlyCoveredInTheOpen : public testing::TestWithParam<Way> {};

TEST_P(PartlyCoveredInTheOpen, SunkenBlockLightsTheRoomAsOneThatStandsOnTheFloor) {
  const auto opened = [](double lowest_m) {
    Scene scene = lit(lowest_m);
    scene.surfaces.erase(scene.surfaces.begin() + 2);  // a wall
    return scene;
  };
  const Scene sunk_scene = opened(-0.07), standing_scene = opened(0.0);
  const std::size_t elements = GetParam() == Way::streamed ? 150 : 800;
  const auto sunk_solution = solved(sunk_scene, GetParam(), elements);
  const auto standing_solution = solved(standing_scene, GetParam(), elements);
  ASSERT_FALSE(sunk_solution->fine().form_factors.closed);
  ASSERT_GT(sunk_solution->fine().form_factors.covered_patches, 5u);
  const Means sunk = means_of(*sunk_solution), standing = means_of(*standing_solution);
  const BandMatrix bound = sunk_solution->surface_irradiance_bound(),
                   other = standing_solution->surface_irradiance_bound();
  for (std::size_t s = 0; s < standing.area_m2.size(); ++s) {
    if (standing.area_m2[s] == 0.0) continue;  // the block's underside
    const auto row = static_cast<Index>(s);
    // Free areas are found to 2 % of an element's, of few elements.
    EXPECT_NEAR(sunk.area_m2[s], standing.area_m2[s], 0.01 * standing.area_m2[s])
        << sunk_scene.surfaces[s].name;
    EXPECT_NEAR(sunk.irradiance[s], standing.irradiance[s],
                bound(row, 0) + other(row, 0) + 0.01 * standing.irradiance[s])
        << sunk_scene.surfaces[s].name;
  }
}

INSTANTIATE_TEST_SUITE_P(Ways, PartlyCoveredInTheOpen,
                         testing::Values(Way::outlines, Way::rays, Way::streamed), name_of);

// Below a sheet it is dark, and yet no element is buried there: the floor's mean is over all of it.
TEST(BuriedElements, AreNotThoseInTheShadowOfASheet) {
  Scene scene = tiny::grey_scene(0.5);
  scene.materials.push_back({"lamp", Reflectance(1, 0.2), RadiantExitance(1, 1.0)});
  tiny::add_surface(scene, "low", {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
  tiny::add_surface(scene, "high", {{0, 0, 1}, {0, 1, 1}, {1, 1, 1}, {1, 0, 1}}, 1);
  tiny::add_surface(scene, "between",
                    {{0.2, 0.2, .5}, {0.7, 0.2, .5}, {0.7, 0.6, .5}, {0.2, 0.6, .5}});
  for (const Way way : {Way::outlines, Way::rays}) {
    const Means means = means_of(*solved(scene, way, 576));
    EXPECT_NEAR(means.area_m2[0], 1.0, 1e-12);
    // View factor by exact visibility, certain to 1e-9, and what the lamp reflects: below 1 %.
    EXPECT_NEAR(means.irradiance[0], 0.121106, 0.01 * 0.121106);
    EXPECT_GT(means.irradiance[0], 0.121106);
  }
}

TEST(PartlyCoveredElements, CellsThatAnotherSurfaceCrossesAreFound) {
  const Scene standing = room_with_block(0.0, 0.5, 0.0), sunk = room_with_block(-0.07, 0.5, 0.0);
  const auto cell = [](double x0, double x1) {
    return Polygon{{x0, 0.4, 0}, {x1, 0.4, 0}, {x1, 0.5, 0}, {x0, 0.5, 0}};
  };
  for (const Scene& scene : {standing, sunk}) {
    EXPECT_TRUE(is_crossed(cell(0.25, 0.35), scene));
    EXPECT_FALSE(is_crossed(cell(0.1, 0.31), scene)) << "an edge on its border";
    EXPECT_FALSE(is_crossed(cell(0.35, 0.5), scene)) << "wholly under it";
    EXPECT_FALSE(is_crossed(cell(0.6, 0.7), scene));
  }
}

}  // namespace
}  // namespace truebox

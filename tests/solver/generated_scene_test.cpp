// SPDX-License-Identifier: BSD-3-Clause
#include "scene/generated_scene.h"

#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <random>

#include "hierarchy/hierarchical_exchange.h"
#include "path_tracer/path_tracer.h"
#include "scene/scene_file.h"
#include "support/scratch.h"
#include "transport/enclosure.h"
#include "transport/prediction.h"

namespace truebox {
namespace {

using Eigen::Index;

Scene made(const std::string& kind, std::size_t patches, std::uint64_t seed = 1) {
  const std::string path = scratch_path(kind + ".toml");
  std::ofstream(path) << generated_scene({kind, patches, seed});
  return read_scene(path);
}

class GeneratedScene : public testing::TestWithParam<std::string> {};

TEST_P(GeneratedScene, IsClosedInThreeBandsAndAboutAsLargeAsAsked) {
  const Scene scene = made(GetParam(), 20000);
  EXPECT_EQ(scene.bands.size(), 3u);
  const PatchMesh mesh = uniform_mesh(scene, edge_for_count(scene, 20000));
  EXPECT_GT(mesh.size(), 10000u);
  EXPECT_LT(mesh.size(), 40000u);
  const Visibility visibility(mesh, scene);
  const auto usable = usable_patches(mesh, scene, visibility, 1);
  const ClosureTest closure = test_closure(mesh, scene, visibility, usable, 1);
  EXPECT_TRUE(closure.closed) << closure.rays;
  EXPECT_GT(closure.rays, 16u * 10000u);
}

TEST_P(GeneratedScene, IsTheSameTextForTheSameSeedOnly) {
  const GeneratedSceneOptions options{GetParam(), 20000, 5};
  EXPECT_EQ(generated_scene(options), generated_scene(options));
  EXPECT_NE(generated_scene(options), generated_scene({GetParam(), 20000, 6}));
}

TEST_P(GeneratedScene, GrowsByRooms) {
  const auto small = static_cast<double>(made(GetParam(), 20000).surfaces.size());
  EXPECT_NEAR(static_cast<double>(made(GetParam(), 80000).surfaces.size()), 4.0 * small,
              0.4 * 4.0 * small);  // whole rooms, and fewer doors at the rim
}

INSTANTIATE_TEST_SUITE_P(Each, GeneratedScene, testing::ValuesIn(generated_scene_kinds()));

TEST(GeneratedSceneOptions, SayWhyTheyCannotBeUsed) {
  EXPECT_THAT((GeneratedSceneOptions{"castle", 5000, 1}.invalid()), testing::HasSubstr("castle"));
  EXPECT_THROW(generated_scene({"museum", 10, 1}), std::invalid_argument);
}

// A room of the museum by links, and paths that share neither mesh nor form factors with them: the
// mean radiosity of random elements in three bands.
TEST(HierarchicalPrediction, AgreesWithPathTracingAtRandomElementsOfARoom) {
  const Scene scene = made("museum", 3400);
  PredictOptions options;
  options.elements = 5000;
  HierarchyOptions hierarchy;
  hierarchy.relative_tolerance = 2e-2;
  options.find_exchange = hierarchical_exchange(hierarchy);
  const Prediction prediction(scene, options);
  ASSERT_EQ(prediction.outcome(), SolveOutcome::converged);
  const PatchMesh& mesh = prediction.fine().mesh;
  const BandMatrix radiosity = prediction.radiosity(), bound = prediction.radiosity_bound();

  std::mt19937_64 random(7);
  std::vector<std::size_t> chosen;
  while (chosen.size() < 128) {
    const std::size_t i = random() % mesh.size();
    // Lamps' own light would hide what is reflected.
    if (prediction.fine().usable[i] &&
        !scene.material_of(scene.surfaces[mesh.surface_of(mesh.patches[i])]).emits())
      chosen.push_back(i);
  }
  PathTraceOptions paths;
  paths.samples = 512;
  const PathTracedImage traced = trace_paths(
      scene, static_cast<int>(chosen.size()), 1,
      [&](int x, int, UnitPair p) -> std::optional<PixelRay> {
        const std::size_t i = chosen[static_cast<std::size_t>(x)];
        Polygon polygon;
        mesh.polygon_of(mesh.patches[i], polygon);
        const Vec3& normal = mesh.plane_of(mesh.patches[i]).normal;
        return PixelRay{sample_polygon(polygon, p.u, p.v) + 1e-4 * normal, -normal};
      },
      paths);
  const Image error = traced.standard_error();
  double bias = 0.0, noise = 0.0, within = 0.0, total = 0.0;
  for (std::size_t c = 0; c < chosen.size(); ++c)
    for (std::size_t b = 0; b < 3; ++b) {
      const auto row = static_cast<Index>(chosen[c]);
      const auto column = static_cast<Index>(b);
      const double pi = std::acos(-1.0);
      const double expected = pi * traced.radiance.channels[b].samples[c];
      const double deviation = pi * error.channels[b].samples[c];
      const double difference = radiosity(row, column) - expected;
      bias += difference;
      noise += deviation * deviation;
      total += expected;
      within += std::abs(difference) <= bound(row, column) + 0.02 * expected + 3.0 * deviation;
    }
  // The mean: 3 standard errors of it, and half of the tolerance of the links, for what they leave
  // out is a spread more than a mean.
  EXPECT_LT(std::abs(bias), 3.0 * std::sqrt(3.0 * noise) + 0.01 * total);
  // The links' tolerance is a root mean square: a twentieth of the elements may exceed it.
  EXPECT_GT(within / (3.0 * static_cast<double>(chosen.size())), 0.95);
}

}  // namespace
}  // namespace truebox

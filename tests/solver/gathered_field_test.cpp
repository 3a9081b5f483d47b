// SPDX-License-Identifier: BSD-3-Clause
#include "transport/gathered_field.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "support/cracks.h"
#include "support/tiny_scenes.h"
#include "transport/prediction.h"
#include "transport/strip_galerkin.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr int kLayers = 5;
constexpr double kRounding = 1e-11;

std::vector<char> all_of(const PatchMesh& mesh) { return std::vector<char>(mesh.size(), 1); }

std::uint32_t piece_named(const PatchMesh& mesh, const Scene& scene, const std::string& name) {
  for (std::uint32_t p = 0; p < mesh.pieces.size(); ++p)
    if (scene.surfaces[mesh.pieces[p].surface].name == name) return p;
  throw std::out_of_range(name);
}

TEST(MeetingLines, AreWhereFacingSurfacesTouch) {
  const Scene scene = tiny::cube_with_block(1.0, 0.5);
  const PatchMesh mesh = uniform_mesh(scene, 0.25);
  const auto count = [&](const char* name) {
    return meeting_lines(mesh, scene, piece_named(mesh, scene, name)).size();
  };
  EXPECT_EQ(count("cube 0"), 8u);  // four walls, four sides of the block
  EXPECT_EQ(count("cube 1"), 4u);  // the block does not reach the ceiling
  EXPECT_EQ(count("cube 2"), 4u);
  EXPECT_EQ(count("block 1"), 0u);  // its lid looks away from its sides
  EXPECT_EQ(count("block 2"), 1u);  // its foot
  const auto line = meeting_lines(mesh, scene, piece_named(mesh, scene, "block 2"))[0];
  EXPECT_NEAR((line.to - line.from).norm(), 0.27, kRounding);
}

TEST(EdgeLayers, CutElementsAtEdgesAndKeepTheirAreas) {
  const Scene scene = tiny::cube(1.0, 0.5);
  const PatchMesh mesh = uniform_mesh(scene, 0.25);
  const LayeredMesh layers = edge_layers(mesh, scene, all_of(mesh), kLayers);
  // Of 4 x 4 elements a face: 4 at two edges, 8 at one, 4 at none.
  const std::size_t across = kLayers + 1;
  EXPECT_EQ(layers.mesh.size(), 6 * (4 * across * across + 8 * across + 4));
  ASSERT_EQ(layers.first_cell.size(), mesh.size() + 1);
  for (std::uint32_t i = 0; i < mesh.size(); ++i) {
    double area = 0.0;
    for (std::uint32_t c = layers.first_cell[i]; c < layers.first_cell[i + 1]; ++c) {
      EXPECT_EQ(layers.parent[c], i);
      area += layers.mesh.patches[c].area_m2;
    }
    EXPECT_NEAR(area, mesh.patches[i].area_m2, kRounding);
  }
  double smallest = 1.0;
  for (const Patch& cell : layers.mesh.patches) smallest = std::min(smallest, cell.area_m2);
  EXPECT_NEAR(std::sqrt(smallest), std::ldexp(0.25, -kLayers), kRounding);
}

TEST(EdgeLayers, LeaveOpeningsAndBuriedElementsWhole) {
  Scene scene = tiny::cube_with_block(1.0, 0.5);
  scene.surfaces[1].is_opening = true;
  const PatchMesh mesh = uniform_mesh(scene, 0.25);
  std::vector<char> usable = all_of(mesh);
  for (std::uint32_t i = 0; i < mesh.size(); i += 2) usable[i] = 0;
  const LayeredMesh layers = edge_layers(mesh, scene, usable, kLayers);
  for (std::uint32_t i = 0; i < mesh.size(); ++i) {
    if (usable[i] && !scene.surfaces[mesh.surface_of(mesh.patches[i])].is_opening) continue;
    EXPECT_EQ(layers.first_cell[i + 1] - layers.first_cell[i], 1u);
  }
  // Without the ceiling a wall meets three others.
  EXPECT_EQ(meeting_lines(mesh, scene, piece_named(mesh, scene, "cube 2")).size(), 3u);
}

// A field over random means in a cube with a block: its parts outlive each other.
struct RandomField {
  Scene scene = tiny::cube_with_block(1.0, 0.5);
  PatchMesh mesh = uniform_mesh(scene, 0.34);
  std::vector<char> usable = all_of(mesh);
  BandMatrix means = random_means(mesh);
  SmoothField smooth{mesh, usable, means};
  Gather gather{mesh, scene, true};
  GatheredField field{{mesh, scene, usable, means, smooth, gather, true}};

  static BandMatrix random_means(const PatchMesh& mesh) {
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> value(1.0, 2.0);
    BandMatrix means(static_cast<Index>(mesh.size()), 1);
    for (Index i = 0; i < means.rows(); ++i) means(i, 0) = value(random);
    return means;
  }
};

TEST(GatheredField, LeavesNoCracksBetweenItsCells) {
  const RandomField random;
  std::size_t edges = 0;
  // Wachspress coordinates keep 1e-9 of a cell's size away from its edges, and a cell may be 32
  // times as long as wide.
  EXPECT_LT(worst_crack(random.field.cells().mesh, random.field, edges), 1e-5);
  EXPECT_GT(edges, 2 * random.field.cells().mesh.size());
}

TEST(GatheredField, FindsTheCellThatHoldsAPoint) {
  const RandomField random;
  const LayeredMesh& cells = random.field.cells();
  for (std::uint32_t c = 0; c < cells.mesh.size(); ++c)
    EXPECT_EQ(random.field.find_cell(cells.parent[c], cells.mesh.patches[c].centroid), c);
}

TEST(GatheredField, ReproducesAFurnaceUpToItsEdgesAndCorners) {
  // Closed, rho = 1/2, M = 1 everywhere: E = B = 2, in corners as well.
  const Scene scene = tiny::cube(1.0, 0.5, 1.0);
  PredictOptions options;
  options.elements = 200;
  options.gathered_up_to = 20000;
  options.solve.relative_bound = 1e-10;
  const Prediction prediction(scene, options);
  ASSERT_EQ(prediction.outcome(), SolveOutcome::converged);
  // Gathering splits near elements and takes the far ones as they are, all of one brightness here:
  // a lost source or part would show as 1e-2 and more.
  constexpr double kGathered = 1e-4;
  Gather::Scratch scratch;
  const std::uint32_t floor = piece_named(prediction.fine().mesh, scene, "cube 0");
  for (const double d : {1e-1, 1e-2, 1e-3, 1e-5})
    for (const Vec3& x : {Vec3(d, d, 0), Vec3(0.5, d, 0), Vec3(1.0 - d, 0.37, 0)}) {
      const BoundedIrradiance light = prediction.irradiance_on(floor, x, scratch);
      EXPECT_NEAR(light.value[0], 2.0, kGathered) << x.transpose();
      EXPECT_LT(light.error_bound[0], 10.0 * kGathered);
    }
}

// A lamp under the ceiling, and a block whose sides look at the edges of its shadow.
Scene room_with_block() {
  Scene scene = tiny::cube_with_block(1.0, 0.7);
  scene.materials.push_back({"lamp", Reflectance(1, 0.7), RadiantExitance(1, 10.0)});
  tiny::add_surface(
      scene, "lamp",
      {{0.35, 0.35, 0.99}, {0.35, 0.65, 0.99}, {0.65, 0.65, 0.99}, {0.65, 0.35, 0.99}}, 1);
  return scene;
}

// Each place counts once: its bound is no standard error, and must hold but where the grids have
// not seen what matters. One in twenty is what a bound at two standard errors would miss.
TEST(RefinedField, IsWithinItsBoundOfLightGatheredOnAFinerGrid) {
  const Scene scene = room_with_block();
  PredictOptions coarse, fine;
  coarse.elements = 250;
  coarse.gathered_up_to = 20000;
  fine.elements = 1000;
  const Prediction field(scene, coarse), truth(scene, fine);
  const PatchMesh& mesh = field.fine().mesh;
  std::mt19937_64 random(3);
  std::uniform_int_distribution<std::uint32_t> any(0, static_cast<std::uint32_t>(mesh.size()) - 1);
  Gather::Scratch scratch;
  int places = 0, outside = 0;
  while (places < 60) {
    const std::uint32_t patch = any(random);
    if (!field.fine().usable[patch]) continue;
    ++places;
    const Piece& piece = mesh.pieces[mesh.patches[patch].piece];
    const auto corners = mesh.corners_of(mesh.patches[patch]);
    const double towards = std::uniform_real_distribution<double>(0.0, 0.95)(random);
    const Vec3 x = mesh.patches[patch].centroid +
                   towards * (mesh.vertices[corners[0]] - mesh.patches[patch].centroid);
    const BoundedIrradiance a = field.irradiance_on(mesh.patches[patch].piece, x, scratch);
    const BoundedIrradiance b = truth.irradiance_at(x, piece.plane.normal);
    outside += std::abs(a.value[0] - b.value[0]) > a.error_bound[0] + b.error_bound[0];
  }
  EXPECT_LE(outside, places / 20);
}

// A duct of unit section, 16 long, its floor a lamp that reflects: half way along it is as good as
// endless.
class Duct : public testing::Test {
 protected:
  static constexpr double kRho = 0.8, kLength_m = 16.0;
  static Scene duct() {
    Scene scene = tiny::grey_scene(kRho);
    scene.materials.push_back({"lamp", Reflectance(1, kRho), RadiantExitance(1, 1.0)});
    tiny::add_box(scene, "duct", Vec3::Zero(), {1.0, kLength_m, 1.0}, true);
    scene.surfaces[0].material = 1;
    return scene;
  }
  static StripEnclosure section() {
    const Eigen::Vector2d a(0, 0), b(1, 0), c(1, 1), d(0, 1);
    StripOptions options;
    options.finest = 1e-8;
    return {{{a, b}, {b, c}, {c, d}, {d, a}}, options};
  }
  PredictOptions options() const {
    PredictOptions options;
    options.elements = 1000;  // edges of 0.25
    options.gathered_up_to = 20000;
    return options;
  }
  const Scene scene_ = duct();
  const StripEnclosure strips_ = section();
  const StripSolution truth_ = strips_.solve({kRho, kRho, kRho, kRho}, {1.0, 0.0, 0.0, 0.0});

  // Irradiance at a distance from the edge of x = 1, on the ceiling and on the floor.
  double true_irradiance(bool on_ceiling, double d) const {
    return on_ceiling ? truth_.radiosity(2, d) / kRho : (truth_.radiosity(0, 1.0 - d) - 1.0) / kRho;
  }
  BoundedIrradiance irradiance(const Prediction& prediction, bool on_ceiling, double d) const {
    Gather::Scratch scratch;
    const std::uint32_t piece =
        piece_named(prediction.fine().mesh, scene_, on_ceiling ? "duct 1" : "duct 0");
    const double y = 0.5 * kLength_m + 0.037;  // not on an edge of elements
    return prediction.irradiance_on(piece, {1.0 - d, y, on_ceiling ? 1.0 : 0.0}, scratch);
  }
};

TEST_F(Duct, IsKnownToOnePercentAtItsEdges) {
  // Each end fills at most (1 / 2) / 8 / (pi 8^2) = 3e-4 of what a point of a wall sees, is no
  // darker than black, and light meets the walls 1 / (1 - rho) = 5 times.
  constexpr double kEnds = 3e-3;
  constexpr double kWanted = 1e-2;  // of pictures
  const Prediction prediction(scene_, options());
  PredictOptions plain = options();
  plain.gathered_up_to = 0;
  const Prediction smooth(scene_, plain);
  double worst_smooth = 0.0;
  for (const bool on_ceiling : {true, false})
    for (const double d : {0.3, 0.1, 0.03, 0.01, 3e-3, 1e-3}) {
      const double truth = true_irradiance(on_ceiling, d);
      const BoundedIrradiance light = irradiance(prediction, on_ceiling, d);
      EXPECT_NEAR(light.value[0] / truth, 1.0, kWanted) << on_ceiling << " " << d;
      EXPECT_NEAR(light.value[0], truth, light.error_bound[0] + kEnds * truth) << d;
      const BoundedIrradiance rough = irradiance(smooth, on_ceiling, d);
      worst_smooth = std::max(worst_smooth, std::abs(rough.value[0] / truth - 1.0));
    }
  EXPECT_GT(worst_smooth, 2.0 * kWanted) << "elements alone would do";
  // The exponent of the rise, from steps of two, so that the value at the edge drops out. A step is
  // 0.5 % of the light: 0.2 of the exponent is 15 % of a step, 1e-3 of the light. A field that is
  // linear there, as one of elements is, would be off by 0.45.
  const auto exponent = [](const auto& at) {
    const double d = 0.25 / 16;
    return std::log2((at(2 * d) - at(d)) / (at(d) - at(d / 2)));
  };
  EXPECT_NEAR(exponent([&](double d) { return irradiance(prediction, false, d).value[0]; }),
              exponent([&](double d) { return true_irradiance(false, d); }), 0.2);
}

}  // namespace
}  // namespace truebox

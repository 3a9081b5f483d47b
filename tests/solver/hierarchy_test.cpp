// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include <cmath>
#include <random>

#include "hierarchy/hierarchical_exchange.h"
#include "hierarchy/kernel_fit.h"
#include "hierarchy/linked_exchange.h"
#include "scene/requirements.h"
#include "support/tiny_scenes.h"
#include "transport/direct_light.h"
#include "transport/legendre.h"
#include "transport/prediction.h"

namespace truebox {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

// A mesh with what every method asks for, lit by a smooth source.
struct Room {
  Scene scene;
  PatchMesh mesh;
  Visibility visibility;
  ShaftCulling culling;
  FormFactorOptions options;
  BandMatrix rho, source;

  explicit Room(Scene made, std::size_t elements)
      : scene(std::move(made)),
        mesh(uniform_mesh(scene, edge_for_count(scene, elements))),
        visibility(mesh, scene),
        culling(mesh, scene, requirements(scene).occlusion) {
    options.occlusion = requirements(scene).occlusion;
    const auto n = static_cast<Index>(mesh.size());
    rho = BandMatrix::Constant(n, 1, 0.6);
    source.resize(n, 1);
    for (Index i = 0; i < n; ++i)
      source(i, 0) = 0.2 + mesh.patches[static_cast<std::size_t>(i)].centroid.z();
  }

  ExchangeRequest request() const {
    return {mesh, scene, visibility, culling, rho, source, options};
  }
  FoundExchange linked(double tolerance) const {
    HierarchyOptions wanted;
    wanted.relative_tolerance = tolerance;
    return hierarchical_exchange(wanted)(request());
  }
  BandMatrix irradiance(const ExchangeOperator& exchange,
                        SolveMethod method = SolveMethod::conjugate_gradient) const {
    SolveOptions solve;
    solve.method = method;
    BandMatrix radiosity, result;
    EXPECT_EQ(solve_radiosity(exchange, rho, source, solve, radiosity, {}, &result).outcome,
              SolveOutcome::converged);
    return result;
  }
  // Root mean square over the area, relative to the mean.
  double difference(const BandMatrix& a, const BandMatrix& b,
                    const std::vector<char>& usable) const {
    double squares = 0.0, mean = 0.0, area = 0.0;
    for (std::size_t i = 0; i < mesh.size(); ++i) {
      if (!usable[i]) continue;
      const auto row = static_cast<Index>(i);
      const double weight = mesh.patches[i].area_m2;
      squares += weight * std::pow(a(row, 0) - b(row, 0), 2);
      mean += weight * b(row, 0);
      area += weight;
    }
    return std::sqrt(squares / area) / (mean / area);
  }
};

VectorXd areas(const PatchMesh& mesh) {
  VectorXd area(static_cast<Index>(mesh.size()));
  for (Index i = 0; i < area.size(); ++i)
    area[i] = mesh.patches[static_cast<std::size_t>(i)].area_m2;
  return area;
}

Links refined(const Room& room, double of_a_link, int most_degree = kMaxLinkDegree) {
  const GroupBasis groups(room.mesh, element_tree(room.mesh));
  const LinkRefinement refinement(room.mesh, room.visibility, groups, room.culling, 1e-4, 1);
  LinkOptions options;
  options.error_of_a_link = of_a_link;
  options.most_degree = most_degree;
  return refinement.refine(
      node_light(groups.tree, areas(room.mesh), room.source, VectorXd::Ones(1)), options);
}

TEST(ElementTree, HoldsEveryElementOnceInsideTheBoxesOfItsGroups) {
  const Room room(tiny::cube_with_block(1.0, 0.5), 600);
  const ElementTree tree = element_tree(room.mesh);
  ASSERT_EQ(tree.nodes.size(), 2 * room.mesh.size() - 1);
  double area = 0.0;
  for (const Patch& patch : room.mesh.patches) area += patch.area_m2;
  EXPECT_NEAR(tree.nodes[0].area_m2, area, 1e-12 * area);
  for (std::size_t k = 0; k < tree.nodes.size(); ++k) {
    const ElementNode& node = tree.nodes[k];
    for (std::uint32_t i : tree.patches_of(node)) {
      EXPECT_LT(room.mesh.plane_of(room.mesh.patches[i]).normal.dot(node.normal), 1.0 + 1e-12);
      for (std::uint32_t v : room.mesh.corners_of(room.mesh.patches[i]))
        EXPECT_LT(node.box.exteriorDistance(room.mesh.vertices[v]), 1e-12);
    }
    if (node.is_leaf()) {
      EXPECT_EQ(tree.leaf_of[tree.order[node.begin]], k);
    } else {
      EXPECT_EQ(tree.nodes[node.left].end, tree.nodes[node.right].begin);
      EXPECT_GT(node.right, node.left);
    }
  }
}

// Brute force: every blocker asked at 4 x 4 points; where the shaft is empty, the closed form
// differs from those points by their quadrature, 1e-3 of the value in elements this small.
TEST(MeanDirect, IsTheMeanOfExactVisibilityAtPoints) {
  Scene scene = tiny::cube_with_block(1.0, 0.5);
  scene.materials.push_back({"lamp", Reflectance(1, 0.5), RadiantExitance(1, 2.0)});
  scene.surfaces[1].material = 1;
  const Room room(scene, 900);
  const Gather gather(room.mesh, room.scene, true);
  const BandMatrix direct =
      mean_direct(room.mesh, room.scene, gather, element_tree(room.mesh), room.culling);
  Gather::Scratch scratch;
  std::vector<std::uint32_t> all;
  for (std::uint32_t p = 0; p < room.mesh.pieces.size(); ++p) all.push_back(p);
  int shadowed = 0;
  for (std::uint32_t i = 0; i < room.mesh.size(); ++i) {
    const double expected = 2.0 * gather.mean_factor(i, 1, all, scratch);
    EXPECT_NEAR(direct(i, 0), expected, 2e-3 * 2.0) << i;
    shadowed += expected > 0.0 && expected < 0.2 ? 1 : 0;
  }
  EXPECT_GT(shadowed, 10);  // the block does stand in the light
}

// Moments of elements, pushed up, are those of their group: total degrees are closed under the
// change from one rectangle to a larger one, which 4 x 4 Gauss points of each element integrate
// exactly. Floats in between.
TEST(GroupBasis, HandsMomentsUpAsTheyAre) {
  const Room room(tiny::cube_with_block(1.0, 0.5), 600);
  const GroupBasis groups(room.mesh, element_tree(room.mesh));
  const auto moments_of = [&](const auto& self, std::size_t k) -> std::vector<double> {
    const ElementNode& node = groups.tree.nodes[k];
    std::vector<double> moments(kMaxTerms, 0.0);
    if (node.is_leaf()) {
      for (Index t = 0; t < kMaxTerms; ++t)
        moments[static_cast<std::size_t>(t)] = groups.moments_m2(groups.tree.order[node.begin], t);
      return moments;
    }
    for (std::size_t child : {node.left, node.right})
      groups.push<1>(child, kMaxLinkDegree, self(self, child).data(), moments.data());
    return moments;
  };
  std::size_t flat = 0;
  for (std::size_t k = 0; k < groups.tree.nodes.size(); ++k) {
    const ElementNode& node = groups.tree.nodes[k];
    const std::vector<double> moments = moments_of(moments_of, k);
    EXPECT_NEAR(moments[0], node.area_m2, 1e-6 * node.area_m2);
    const GroupFrame& frame = groups.frames[k];
    if (!frame.is_flat || node.is_leaf()) continue;
    ++flat;
    // s and s t: the coordinates' own means, up to the factors of the orthonormal polynomials.
    double s_mean = 0.0;
    for (std::uint32_t i : groups.tree.patches_of(node))
      s_mean += room.mesh.patches[i].area_m2 * frame.coordinates(room.mesh.patches[i].centroid)[0];
    EXPECT_NEAR(moments[1], std::sqrt(3.0) * s_mean, 1e-6 * node.area_m2);
    // A group that fills its rectangle has no other moments than its area.
    const double rectangle_m2 = 4.0 * frame.half_u.norm() * frame.half_v.norm();
    if (std::abs(rectangle_m2 - node.area_m2) > 1e-9 * node.area_m2) continue;
    for (std::size_t t = 1; t < kMaxTerms; ++t)
      EXPECT_NEAR(moments[t], 0.0, 1e-6 * node.area_m2) << t;
  }
  EXPECT_GT(flat, 100u);
}

// Two rectangles at right angles: the error over random points falls with the degree, and is what
// the fit says of itself, within a factor of 2.
TEST(KernelFit, KnowsWhatEachDegreeLeavesOut) {
  const GroupFrame floor{{0.5, 0.5, 0.0}, {0.5, 0.0, 0.0}, {0.0, 0.5, 0.0}, true};
  const GroupFrame wall{{1.8, 0.3, 0.7}, {0.0, 0.4, 0.0}, {0.0, 0.0, 0.4}, true};
  const Vec3 up = Vec3::UnitZ(), left = -Vec3::UnitX();
  const KernelFit fit = fit_kernel(floor, up, wall, left);
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> of(-1.0, 1.0);
  std::array<double, kMaxLinkDegree + 1> squares{};
  constexpr int kPoints = 4000;
  for (int p = 0; p < kPoints; ++p) {
    const std::array<double, 4> st = {of(random), of(random), of(random), of(random)};
    const Vec3 x = floor.centre + st[0] * floor.half_u + st[1] * floor.half_v;
    const Vec3 y = wall.centre + st[2] * wall.half_u + st[3] * wall.half_v, r = y - x;
    const double kernel =
        up.dot(r) * -left.dot(r) / (std::acos(-1.0) * r.squaredNorm() * r.squaredNorm());
    std::array<std::array<double, 4>, 4> value;
    for (std::size_t c = 0; c < 4; ++c) legendre(0.5 * (st[c] + 1.0), 3, value[c].data());
    const auto basis = [&](std::size_t first, std::size_t term) {
      const auto [a, b] = kDegreesOfTerm[term];
      return value[first][static_cast<std::size_t>(a)] *
             value[first + 1][static_cast<std::size_t>(b)];
    };
    for (int d = 0; d <= kMaxLinkDegree; ++d) {
      double fitted = 0.0;
      for (std::size_t k = 0; k < static_cast<std::size_t>(terms_of(d)); ++k)
        for (std::size_t l = 0; l < static_cast<std::size_t>(terms_of(d)); ++l)
          fitted += static_cast<double>(fit.coefficient_per_m2[k][l]) * basis(0, k) * basis(2, l);
      squares[static_cast<std::size_t>(d)] += std::pow(fitted - kernel, 2) / kPoints;
    }
  }
  for (std::size_t d = 0; d <= kMaxLinkDegree; ++d) {
    const double error = std::sqrt(squares[d]);
    EXPECT_LT(error, 2.0 * fit.of_degree[d].spread) << d;
    EXPECT_GT(error, 0.5 * fit.of_degree[d].spread) << d;
    if (d > 0) {
      EXPECT_LT(error, 0.5 * std::sqrt(squares[d - 1])) << d;
    }
  }
}

TEST(LinkedExchange, IsSymmetricAndItsProductIsThatOfItsRows) {
  const Room room(tiny::cube_with_block(1.0, 0.5), 400);
  EXPECT_GT(refined(room, 1e-3).polynomial.size(), 50u);
  const FoundExchange found = room.linked(3e-2);
  const Index n = found.exchange->size();
  Eigen::MatrixXd s(n, n);
  for (Index i = 0; i < n; ++i) found.exchange->row(i, s.col(i));
  EXPECT_LT(found.links->links, static_cast<std::size_t>(n) * 40);
  EXPECT_LT((s - s.transpose()).cwiseAbs().maxCoeff(), 4e-16 * s.maxCoeff());  // rounding
  // Damped where a polynomial would be negative at its corners.
  EXPECT_GT(s.minCoeff(), -1e-3 * s.mean());
  for (Index bands : {1, 2, 3, 11}) {
    const BandMatrix x = BandMatrix::Random(n, bands);
    EXPECT_LT((found.exchange->product(x) - s * x).cwiseAbs().maxCoeff(), 1e-14) << bands;
  }
  EXPECT_NEAR(s.colwise().sum().transpose().cwiseQuotient(found.exchange->area_m2()).maxCoeff(),
              found.exchange->row_sum_max(), 1e-12);
}

// rho = 1/2, B0 = 1 everywhere, closed: B = 2. Rows that sum to 1 make it exact at any tolerance.
TEST(HierarchicalExchange, ReproducesTheFurnaceAndSaysWhatTheRowsWereOffBy) {
  Room room(tiny::cube_with_block(1.0, 0.5), 500);
  room.rho.setConstant(0.5);
  room.source.setConstant(1.0);
  const FoundExchange found = room.linked(5e-2);
  EXPECT_TRUE(found.summary.closed);
  EXPECT_GT(found.summary.closure_error_max, 1e-3);  // coarse links were not exact
  EXPECT_LT(found.summary.closure_residual_max, 1e-8);
  EXPECT_GT(found.summary.buried_patches, 0u);  // under the block
  const BandMatrix irradiance = room.irradiance(*found.exchange);
  for (std::size_t i = 0; i < room.mesh.size(); ++i)
    EXPECT_NEAR(irradiance(static_cast<Index>(i), 0), found.usable[i] ? 2.0 : 0.0, 1e-6);
}

// Occlusion and interreflection, against the full matrix: the error follows the tolerance, and the
// estimate is worth something: within a factor of 3 either way, unless below the rays' own noise.
TEST(HierarchicalExchange, ApproachesTheFullMatrixAsItsEstimateSays) {
  Room room(tiny::cube_with_block(1.0, 0.5), 1200);
  room.options.method = FormFactorMethod::exact_visibility;
  const DenseExchange full(std::make_unique<FormFactors>(
      form_factors(room.mesh, room.scene, room.visibility, room.options)));
  const BandMatrix truth = room.irradiance(full);
  double last = 1.0;
  for (double tolerance : {4e-2, 1e-2, 2.5e-3}) {
    const FoundExchange found = room.linked(tolerance);
    const double error = room.difference(room.irradiance(*found.exchange), truth, found.usable);
    EXPECT_LT(error, 3.0 * found.links->relative_error) << tolerance;
    EXPECT_GT(error, found.links->relative_error / 10.0) << tolerance;
    EXPECT_LT(error, 0.7 * last) << tolerance;
    last = error;
  }
}

// Without anything between, down to single elements: the accurate kernel of each pair.
TEST(HierarchicalExchange, IsTheFullMatrixWhereEveryElementIsLinked) {
  const Room room(tiny::cube(1.0, 0.5), 96);
  const VectorXd area = areas(room.mesh);
  const LinkedExchange exchange(
      std::make_shared<const GroupBasis>(room.mesh, element_tree(room.mesh)), area,
      refined(room, 1e-14));
  FormFactorOptions options = room.options;
  options.relative_tolerance = 1e-10;
  const FormFactors full = form_factors(room.mesh, room.scene, room.visibility, options);
  VectorXd row(area.size());
  for (Index i = 0; i < area.size(); ++i) {
    exchange.row(i, row);
    // The kernel's tolerance, 1e-4 of the largest entry, and floats.
    EXPECT_LT((row - full.exchange_area_m2.col(i)).cwiseAbs().maxCoeff(),
              2e-4 * full.exchange_area_m2.col(i).maxCoeff());
  }
}

TEST(HierarchicalExchange, IsSolvedByEveryMethodAlike) {
  const Room room(tiny::cube_with_block(1.0, 0.5), 300);
  const FoundExchange found = room.linked(2e-2);
  const BandMatrix expected = room.irradiance(*found.exchange);
  for (const std::string& name : method_names())
    EXPECT_LT(
        (room.irradiance(*found.exchange, method_of_name(name)) - expected).cwiseAbs().maxCoeff(),
        1e-6)
        << name;
}

TEST(HierarchicalExchange, IsTheSameOnAnyNumberOfThreads) {
  const Room room(tiny::cube_with_block(1.0, 0.5), 400);
  const auto run = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return room.irradiance(*room.linked(1e-2).exchange);
  };
  EXPECT_EQ((run(1) - run(2)).cwiseAbs().maxCoeff(), 0.0);
}

// A wall between two halves: one blocker closes every shaft, no ray is spent and no link made.
TEST(LinkRefinement, DropsGroupsThatOneBlockerHides) {
  Scene scene = tiny::grey_scene(0.5);
  tiny::add_surface(scene, "left", {{0, 0, 0}, {0, 1, 0}, {0, 1, 1}, {0, 0, 1}});
  tiny::add_surface(scene, "right", {{3, 0, 0}, {3, 0, 1}, {3, 1, 1}, {3, 1, 0}});
  const Room open(scene, 128);
  EXPECT_GT(refined(open, 1e-3).size(), 0u);
  tiny::add_surface(scene, "wall", {{1, -2, -2}, {1, 3, -2}, {1, 3, 3}, {1, -2, 3}});
  const Room closed(scene, 1024);
  const Links links = refined(closed, 1e-3);
  const ElementTree tree = element_tree(closed.mesh);
  for (const Link& link : links.links) {
    const double x = tree.nodes[link.a].centre.x() + tree.nodes[link.b].centre.x();
    EXPECT_NEAR(x, 4.0, 1e-9);  // the wall's lit side and the right one only
  }
  EXPECT_EQ(links.counts.rays, 0u);
  EXPECT_GT(links.counts.hidden, 0u);
}

// The exponent p of links ~ n^p by least squares.
double exponent(const std::vector<std::size_t>& elements, const std::vector<std::size_t>& links) {
  double n = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
  for (std::size_t k = 0; k < elements.size(); ++k) {
    const double u = std::log(static_cast<double>(elements[k]));
    const double v = std::log(static_cast<double>(links[k]));
    n += 1.0, x += u, y += v, xx += u * u, xy += u * v;
  }
  return (n * xy - x * y) / (n * xx - x * x);
}

// At a fixed tolerance links grow no faster than elements, although pairs grow like their square:
// in one room they stop growing once elements are smaller than links.
TEST(LinkRefinement, MakesNoMoreThanLinearlyManyLinksAtAFixedTolerance) {
  for (const Scene& scene : {tiny::cube(1.0, 0.5), tiny::cube_with_block(1.0, 0.5)}) {
    std::vector<std::size_t> elements, links;
    for (std::size_t wanted : {800u, 3200u, 12800u}) {
      const Room room(scene, wanted);
      elements.push_back(room.mesh.size());
      links.push_back(refined(room, 2e-4).size());
    }
    EXPECT_LT(exponent(elements, links), 0.6);
  }
}

// More rooms at the same tolerance, each behind the wall of the next: linear.
TEST(LinkRefinement, MakesLinksInProportionToRooms) {
  std::vector<std::size_t> elements, links;
  for (int rooms : {2, 4, 8}) {
    Scene scene = tiny::grey_scene(0.5);
    for (int k = 0; k < rooms; ++k)
      tiny::add_box(scene, "room", Vec3(1.1 * k, 0, 0), Vec3(1.1 * k + 1, 1, 1), true);
    const Room room(scene, 300u * static_cast<std::size_t>(rooms));
    elements.push_back(room.mesh.size());
    // The same error in each room: its weight is the root of the room's share of the area.
    links.push_back(refined(room, 1e-3 / std::sqrt(rooms)).size());
  }
  EXPECT_NEAR(exponent(elements, links), 1.0, 0.15);
}

TEST(LinkRefinement, NeedsFewerLinksOfHigherDegrees) {
  const Room room(tiny::cube(1.0, 0.5), 2400);
  EXPECT_LT(refined(room, 1e-5).size(), refined(room, 1e-5, 0).size() / 3);
}

// The caveat (Garmann 1995): two fixed patches and a tolerance that goes to 0 link all N^2 pairs.
TEST(LinkRefinement, LinksAllPairsOfTwoPatchesWhereNothingMayBeLeftOut) {
  Scene scene = tiny::grey_scene(0.5);
  tiny::add_surface(scene, "below", {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
  tiny::add_surface(scene, "above", {{0, 0, 1}, {0, 1, 1}, {1, 1, 1}, {1, 0, 1}});
  for (std::size_t side : {4u, 8u, 16u}) {
    const Room room(scene, 2 * side * side);
    ASSERT_EQ(room.mesh.size(), 2 * side * side);
    EXPECT_EQ(refined(room, 1e-15).size(), side * side * side * side);
    EXPECT_LE(refined(room, 1e-2).size(), 64u);  // at a fixed one it is as if N were 4
  }
}

TEST(HierarchicalExchange, HoldsOneElementAlone) {
  Scene scene = tiny::grey_scene(0.5);
  tiny::add_surface(scene, "alone", {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
  const Room room(scene, 1);
  ASSERT_EQ(room.mesh.size(), 1u);
  const FoundExchange found = room.linked(1e-2);
  EXPECT_EQ(found.links->links, 0u);
  EXPECT_EQ(room.irradiance(*found.exchange)(0, 0), 0.0);
}

TEST(HierarchicalExchange, IsDarkWhereThereIsNoLight) {
  Room room(tiny::cube_with_block(1.0, 0.5), 200);
  room.source.setZero();
  const FoundExchange found = room.linked(1e-2);
  EXPECT_EQ(room.irradiance(*found.exchange).cwiseAbs().maxCoeff(), 0.0);
  EXPECT_LT(found.summary.closure_residual_max, 1e-8);
}

// A tolerance that no links meet: all that elements can do, and an estimate that says so.
TEST(HierarchicalExchange, SaysWhatItLeavesOutWhereTheToleranceIsOutOfReach) {
  const Room room(tiny::cube_with_block(1.0, 0.5), 150);
  const FoundExchange found = room.linked(1e-6);
  EXPECT_GT(found.links->relative_error, 1e-6);
  FormFactorOptions options = room.options;
  options.method = FormFactorMethod::exact_visibility;
  const DenseExchange full(
      std::make_unique<FormFactors>(form_factors(room.mesh, room.scene, room.visibility, options)));
  EXPECT_LT(room.difference(room.irradiance(*found.exchange), room.irradiance(full), found.usable),
            3.0 * found.links->relative_error);
}

TEST(HierarchicalExchange, RefusesWhatDoesNotFitAndSaysWhatWould) {
  HierarchyOptions options;
  options.memory_limit_bytes = std::size_t{64} << 20;
  EXPECT_NO_THROW(require_memory(1000, options));
  try {
    require_memory(1000000, options);
    FAIL() << "a million elements in 64 MiB";
  } catch (const std::length_error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("that fits about"));
  }
  const Room room(tiny::cube_with_block(1.0, 0.5), 800);
  options.memory_limit_bytes = room.mesh.size() * 5300;  // room for the tree, not for the links
  options.relative_tolerance = 1e-4;
  try {
    hierarchical_exchange(options)(room.request());
    FAIL() << "links without memory";
  } catch (const std::length_error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("tolerance twice as large"));
  }
  options.relative_tolerance = 0.0;
  EXPECT_THROW(hierarchical_exchange(options), std::invalid_argument);
}

}  // namespace
}  // namespace truebox

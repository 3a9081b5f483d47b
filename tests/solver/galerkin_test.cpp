// SPDX-License-Identifier: BSD-3-Clause
#include "transport/galerkin.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "mesh/graded_mesh.h"
#include "support/tiny_scenes.h"
#include "transport/form_factor.h"
#include "transport/moment_integrals.h"
#include "transport/quadrature.h"
#include "transport/visible_moments.h"

namespace truebox {
namespace {

using Eigen::Index;

const Polygon kTriangle = {{0.0, 0.0, 0.0}, {2.0, 0.0, 0.0}, {0.3, 1.0, 0.0}};
const Polygon kParallelogram = {{0.0, 0.0, 0.0}, {2.0, 0.0, 0.0}, {2.5, 1.0, 0.0}, {0.5, 1.0, 0.0}};

TEST(PolynomialElement, IsOrthonormalOnParallelogramsAndTriangles) {
  for (const Polygon& polygon : {kTriangle, kParallelogram}) {
    const PolynomialElement e(polygon, kMaxElementDegree);
    const int n = e.functions();
    EXPECT_EQ(n, polygon.size() == 3 ? 28 : 49);
    Eigen::MatrixXd product = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd phi(n);
    const GaussRule& rule = gauss_rule(16);
    for (int l = 0; l < 16; ++l)
      for (int k = 0; k < 16; ++k) {
        e.evaluate(rule.nodes[l], rule.nodes[k], phi.data());
        product += rule.weights[l] * rule.weights[k] * e.jacobian_m2(rule.nodes[l]) * phi *
                   phi.transpose();
      }
    // Degree 13 in each parameter, exact to rounding.
    EXPECT_LT((product - Eigen::MatrixXd::Identity(n, n)).cwiseAbs().maxCoeff(), 1e-12);
  }
}

TEST(PolynomialElement, FindsTheParametersOfItsPoints) {
  for (const Polygon& polygon : {kTriangle, kParallelogram}) {
    const PolynomialElement e(polygon, 1);
    const auto [u, v] = e.parameters(e.at(0.37, 0.81));
    EXPECT_NEAR(u, 0.37, 1e-14);
    EXPECT_NEAR(v, 0.81, 1e-14);
  }
}

TEST(PolynomialElement, CutsOtherQuadsIntoTriangles) {
  const Polygon trapezium = {{0, 0, 0}, {2, 0, 0}, {1.5, 1, 0}, {0.5, 1, 0}};
  const auto parts = polynomial_elements(trapezium, 2);
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_NEAR(parts[0].area_m2() + parts[1].area_m2(), 1.5, 1e-15);
  EXPECT_EQ(polynomial_elements(kParallelogram, 2).size(), 1u);
}

TEST(GatheredMoments, AreLambertsFormulaForTheConstant) {
  for (const Polygon& polygon : {kTriangle, kParallelogram}) {
    const PolynomialElement e(polygon, 3);
    // Far, near, over an edge, and a hair above the inside.
    for (const Vec3& x :
         {Vec3(0.4, 0.2, 30.0), Vec3(0.4, 0.2, 0.5), Vec3(1.0, 0.0, 1e-3), Vec3(0.9, 0.4, 1e-7)}) {
      // Tilted only where the whole source stays above the receiver's horizon.
      const Vec3 normal = x.z() > 0.4 ? Vec3(0.1, -0.05, -1.0).normalized() : Vec3(-Vec3::UnitZ());
      Eigen::VectorXd sum = Eigen::VectorXd::Zero(e.functions());
      add_gathered_moments(x, normal, e, 1e-11, sum.data());
      EXPECT_NEAR(sum[0] * std::sqrt(e.area_m2()), point_to_polygon(x, normal, polygon), 1e-9)
          << x.transpose();
    }
    Eigen::VectorXd behind = Eigen::VectorXd::Zero(e.functions());
    add_gathered_moments({0.4, 0.2, -1.0}, Vec3::UnitZ(), e, 1e-9, behind.data());
    EXPECT_EQ(behind.norm(), 0.0);
  }
}

TEST(ExchangeMoments, AreTheExchangeAreaForTheConstants) {
  const Polygon floor = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  struct Case {
    Polygon other;
    double tolerance;
  };
  // Touching pairs hold a few 1e-7 where the crowded rules meet a singular corner; else 1e-9.
  const Case cases[] = {{{{0, 0, 1}, {0, 1, 1}, {1, 1, 1}, {1, 0, 1}}, 1e-9},
                        {{{0, 0, 0.1}, {0, 1, 0.1}, {1, 1, 0.1}, {1, 0, 0.1}}, 1e-7},
                        {{{0, 0, 0}, {0, 0, 1}, {1, 0, 1}, {1, 0, 0}}, 1e-6},
                        {{{0.2, 0, 0}, {0.2, 0, 0.1}, {0.7, 0, 0.1}, {0.7, 0, 0}}, 1e-6},
                        {{{1, 0, 0}, {1, 0, 0.05}, {2, 0, 0.05}, {2, 0, 0}}, 5e-6},
                        {{{0, 0, 0}, {0, 0, 1}, {1, 0, 0}}, 1e-6}};
  for (const Case& c : cases) {
    const double exact = exchange_area_m2(PlanarPolygon(floor), PlanarPolygon(c.other), 1e-13);
    const PolynomialElement i(floor, 2), j(c.other, 2);
    const Eigen::MatrixXd k = exchange_moments(i, j, 1e-10);
    EXPECT_NEAR(k(0, 0) * std::sqrt(i.area_m2() * j.area_m2()) / exact, 1.0, c.tolerance)
        << c.other[0].transpose();
    // Higher moments, integrated over the other element first where both are equally large.
    EXPECT_LT((k - exchange_moments(j, i, 1e-10).transpose()).norm(), 1e-5);
  }
}

// Prism over a right triangle, lit sides inwards: triangles and quads, closed.
Scene prism() {
  Scene scene = tiny::grey_scene(0.5);
  const Vec3 a(0, 0, 0), b(1, 0, 0), c(0, 1, 0), up(0, 0, 0.7);
  tiny::add_surface(scene, "floor", {a, b, c});
  tiny::add_surface(scene, "ceiling", {a + up, c + up, b + up});
  tiny::add_surface(scene, "front", {a, a + up, b + up, b});
  tiny::add_surface(scene, "slope", {b, b + up, c + up, c});
  tiny::add_surface(scene, "side", {c, c + up, a + up, a});
  return scene;
}

TEST(GalerkinSystem, ClosesInEveryMoment) {
  // K 1 = 1 in a closed scene, tested with every polynomial. Near pairs hold a few 1e-6.
  constexpr double kNearPairs = 5e-6;
  for (const Scene& scene : {tiny::cube(2.0, 0.5), prism()}) {
    const PatchMesh mesh = uniform_mesh(scene, scene.surfaces.size() == 6 ? 1.0 : 0.6);
    GalerkinOptions options;
    options.degree = 2;
    options.relative_tolerance = 1e-8;
    const GalerkinSystem system(mesh, scene, options);
    const auto n = static_cast<Index>(scene.surfaces.size());
    const Eigen::VectorXd one = system.project_constants(BandMatrix::Ones(n, 1));
    EXPECT_LT((system.kernel() * one - one).cwiseAbs().maxCoeff(), kNearPairs * one.maxCoeff());
    EXPECT_EQ(system.kernel(), system.kernel().transpose());

    BandMatrix rho(n, 3), b;
    rho.col(0).setConstant(0.0);
    rho.col(1).setConstant(0.5);
    rho.col(2).setConstant(0.99);
    const BandMatrix exitance = BandMatrix::Ones(n, 3);
    ASSERT_EQ(system.solve(rho, system.project_constants(exitance), b).outcome,
              SolveOutcome::converged);
    const BandMatrix mean = system.surface_means(b);
    for (Index s = 0; s < n; ++s)
      for (Index k = 0; k < 3; ++k) {
        const double furnace = 1.0 / (1.0 - rho(s, k));
        EXPECT_NEAR(mean(s, k), furnace, kNearPairs * furnace * furnace) << s << " " << k;
      }
  }
}

TEST(GalerkinSystem, LowerDegreeIsABlockOfTheHigher) {
  const Scene scene = prism();
  const PatchMesh mesh = uniform_mesh(scene, 1.0);
  GalerkinOptions options;
  options.degree = 3;
  options.relative_tolerance = 1e-6;
  const GalerkinSystem cubic(mesh, scene, options);
  for (int degree = 0; degree < 3; ++degree) {
    options.degree = degree;
    const GalerkinSystem direct(mesh, scene, options), block = cubic.at_degree(degree);
    ASSERT_EQ(direct.unknowns(), block.unknowns());
    // Rules of other orders: as far apart as their tolerance allows.
    EXPECT_LT((direct.kernel() - block.kernel()).cwiseAbs().maxCoeff(), 2e-5) << degree;
  }
  EXPECT_THROW(cubic.at_degree(4), std::invalid_argument);
}

TEST(GalerkinSystem, RefusesWhatItCannotSolve) {
  const Scene cube = tiny::cube(1.0, 0.5);
  const PatchMesh mesh = uniform_mesh(cube, 1.0);
  GalerkinOptions options;
  options.degree = kMaxElementDegree + 1;
  EXPECT_THROW(GalerkinSystem(mesh, cube, options), std::invalid_argument);
  options.degree = 1;
  options.relative_tolerance = 0.0;
  EXPECT_THROW(GalerkinSystem(mesh, cube, options), std::invalid_argument);
  options.relative_tolerance = 1e-6;
  options.memory_limit_bytes = 1000;
  EXPECT_THROW(GalerkinSystem(mesh, cube, options), std::length_error);
}

TEST(GradedMesh, CrowdsTowardsTheEdgesWhereSurfacesMeet) {
  const Scene cube = tiny::cube(1.0, 0.5);
  const PatchMesh mesh = graded_mesh(cube, 0.25, 3.0);
  ASSERT_EQ(mesh.size(), 96u);
  double smallest = 1.0, total = 0.0;
  for (const Patch& patch : mesh.patches) {
    smallest = std::min(smallest, patch.area_m2);
    total += patch.area_m2;
  }
  EXPECT_NEAR(total, 6.0, 1e-13);
  EXPECT_NEAR(smallest, std::pow(0.5 * std::pow(0.5, 3.0), 2.0), 1e-15);  // (1/2 (1/2)^3)^2
  // Two plates apart meet nothing: uniform whatever the power.
  Scene plates = tiny::grey_scene(0.5);
  tiny::add_surface(plates, "low", {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
  tiny::add_surface(plates, "high", {{0, 0, 1}, {0, 1, 1}, {1, 1, 1}, {1, 0, 1}});
  for (const Patch& patch : graded_mesh(plates, 0.25, 3.0).patches)
    EXPECT_NEAR(patch.area_m2, 1.0 / 16.0, 1e-15);
}

// rho = 1/2, M = 1, a block in the room: B = 2, and its mean needs exact row sums.
TEST(OccludedGalerkin, SolvesAFurnaceWithABlock) {
  const Scene scene = tiny::cube_with_block(1.0, 0.5, 1.0);
  GalerkinOptions options;
  options.degree = 1;
  options.relative_tolerance = 1e-6;
  const GalerkinSystem system(uniform_mesh(scene, 0.5), scene, options);
  const auto surfaces = static_cast<Index>(scene.surfaces.size());
  BandMatrix coefficients;
  system.solve(BandMatrix::Constant(surfaces, 1, 0.5),
               system.project_constants(BandMatrix::Ones(surfaces, 1)), coefficients);
  const BandMatrix mean = system.surface_means(coefficients);
  for (Index s = 0; s < surfaces; ++s) {
    if (mean(s, 0) == 0.0) continue;  // the block's underside
    // Kinks where shadows begin, met by 8 x 8 points: a few 1e-4 of each row.
    EXPECT_NEAR(mean(s, 0), 2.0, 4e-3) << scene.surfaces[static_cast<std::size_t>(s)].name;
  }
}

// B chosen, M = B - rho int V K B from exact visibility at every point: the field is smooth
// although what hides it is not, and the order is that of the basis.
TEST(OccludedGalerkin, ConvergesAtTheOrderOfItsBasisBehindABlock) {
  const Scene scene = tiny::cube_with_block(1.0, 0.5);
  const auto chosen = [](std::size_t, const Vec3& x) {
    return 1.0 + 0.4 * x.x() - 0.3 * x.y() + 0.5 * x.z() * x.z() + 0.2 * x.x() * x.y();
  };
  // Whole surfaces hold B as quadratics.
  GalerkinOptions options;
  options.degree = 2;
  options.relative_tolerance = 1e-6;
  const PatchMesh whole = uniform_mesh(scene, 1.0);
  const VisibleMoments visible(whole, scene);
  std::vector<PolynomialElement> sources;
  std::vector<Eigen::VectorXd> of_source;
  std::vector<Plane> planes;
  for (const Surface& surface : scene.surfaces) {
    planes.push_back(plane_of(surface.pieces[0]));
    const PolynomialElement& e = sources.emplace_back(surface.pieces[0], 2);
    Eigen::VectorXd c = Eigen::VectorXd::Zero(e.functions()), phi(e.functions());
    const GaussRule& rule = gauss_rule(6);
    for (int l = 0; l < 6; ++l)
      for (int k = 0; k < 6; ++k) {
        e.evaluate(rule.nodes[l], rule.nodes[k], phi.data());
        c += rule.weights[l] * rule.weights[k] * e.jacobian_m2(rule.nodes[l]) *
             chosen(0, e.at(rule.nodes[l], rule.nodes[k])) * phi;
      }
    of_source.push_back(std::move(c));
  }
  const auto own = [&](std::size_t surface, const Vec3& x) {
    double received = 0.0;
    for (std::size_t s = 0; s < sources.size(); ++s) {
      if (s == surface) continue;
      Eigen::VectorXd moments = Eigen::VectorXd::Zero(sources[s].functions());
      visible.add_gathered(x, planes[surface].normal, sources[s],
                           visible.between(sources[surface], sources[s]), moments.data());
      received += moments.dot(of_source[s]);
    }
    return chosen(surface, x) - 0.5 * received;
  };
  const auto surfaces = static_cast<Index>(scene.surfaces.size());
  for (const int degree : {0, 1}) {
    options.degree = degree;
    double error[2];
    for (int k = 0; k < 2; ++k) {
      const GalerkinSystem system(uniform_mesh(scene, k == 0 ? 0.5 : 0.25), scene, options);
      BandMatrix coefficients, source = system.project(own);
      system.solve(BandMatrix::Constant(surfaces, 1, 0.5), source, coefficients);
      error[k] = system.distance_to(coefficients.col(0), chosen);
    }
    EXPECT_GT(std::log2(error[0] / error[1]), degree + 0.8) << error[0] << ' ' << error[1];
  }
}

}  // namespace
}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/smooth_field.h"

#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <random>

#include "support/tiny_scenes.h"

namespace truebox {
namespace {

using Function = std::function<double(double, double)>;

constexpr double kRounding = 1e-11;  // relative: a least squares fit of a few dozen rows

const Polygon kQuad = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
const Polygon kBentQuad = {{0, 0, 0}, {1, 0.1, 0}, {0.8, 1, 0}, {-0.1, 0.7, 0}};
const Polygon kTriangle = {{0, 0, 0}, {1, 0, 0}, {0.2, 0.9, 0}};
const Polygon kPentagon = {{0, 0, 0}, {1, 0, 0}, {1.2, 0.6, 0}, {0.5, 1, 0}, {-0.1, 0.6, 0}};

PatchMesh mesh_of(const Polygon& polygon, double edge) {
  Scene scene = tiny::grey_scene(0.5);
  tiny::add_surface(scene, "piece", polygon);
  return uniform_mesh(scene, edge);
}

// Mean over a polygon by 7-point (degree 5) quadrature of each fan triangle (Strang & Fix 1973).
double mean_of(const Function& f, const Polygon& p) {
  constexpr double kA = 0.059715871789770, kB = 0.470142064105115, kWeightAB = 0.132394152788506;
  constexpr double kC = 0.797426985353087, kD = 0.101286507323456, kWeightCD = 0.125939180544827;
  double sum = 0.0, area = 0.0;
  for (std::size_t i = 2; i < p.size(); ++i) {
    const Vec3 t[3] = {p[0], p[i - 1], p[i]};
    const double part = 0.5 * (t[1] - t[0]).cross(t[2] - t[0]).norm();
    const auto at = [&](double a, double b, double c) {
      const Vec3 x = a * t[0] + b * t[1] + c * t[2];
      return f(x.x(), x.y());
    };
    double mean = 0.225 * at(1 / 3.0, 1 / 3.0, 1 / 3.0);
    mean += kWeightAB * (at(kA, kB, kB) + at(kB, kA, kB) + at(kB, kB, kA));
    mean += kWeightCD * (at(kC, kD, kD) + at(kD, kC, kD) + at(kD, kD, kC));
    sum += part * mean;
    area += part;
  }
  return sum / area;
}

double worst_error(const PatchMesh& mesh, const Function& f, unsigned seed) {
  BandMatrix means(static_cast<Eigen::Index>(mesh.size()), 1);
  Polygon polygon;
  for (std::size_t i = 0; i < mesh.size(); ++i) {
    mesh.polygon_of(mesh.patches[i], polygon);
    means(static_cast<Eigen::Index>(i), 0) = mean_of(f, polygon);
  }
  const SmoothField field(mesh, std::vector<char>(mesh.size(), 1), means);
  std::mt19937_64 random(seed);
  std::exponential_distribution<double> exponential;
  Eigen::VectorXd value(1);
  double worst = 0.0;
  for (int trial = 0; trial < 500; ++trial) {
    Vec3 x = Vec3::Zero();
    double total = 0.0;
    for (const Vec3& v : mesh.pieces[0].polygon) {
      const double w = exponential(random);
      x += w * v;
      total += w;
    }
    x /= total;
    field.evaluate(field.find_patch(0, x), x, value);
    worst = std::max(worst, std::abs(value[0] - f(x.x(), x.y())));
  }
  return worst;
}

struct Shape {
  std::string name;
  Polygon polygon;
};

class SmoothFieldOn : public testing::TestWithParam<Shape> {};

TEST_P(SmoothFieldOn, ReproducesConstants) {
  EXPECT_LT(worst_error(
                mesh_of(GetParam().polygon, 0.2), [](double, double) { return 3.0; }, 31),
            3.0 * kRounding);
}

TEST_P(SmoothFieldOn, ReproducesLinearFunctions) {
  const Function f = [](double x, double y) { return 5.0 + 2.0 * x - 3.0 * y; };
  EXPECT_LT(worst_error(mesh_of(GetParam().polygon, 0.2), f, 32), 10.0 * kRounding);
}

// Third order, borders included: there a third ring of elements completes the quadratic.
TEST_P(SmoothFieldOn, IsBetterThanSecondOrder) {
  constexpr double kLowestOrder =
      2.5;  // third order, less what two grids of finite size leave to chance
  const Function f = [](double x, double y) {
    return 3.0 + std::sin(2.0 * x + 0.5) * std::cos(1.5 * y);
  };
  const double coarse = worst_error(mesh_of(GetParam().polygon, 0.1), f, 33);
  const double fine = worst_error(mesh_of(GetParam().polygon, 0.025), f, 33);
  const double order = std::log(coarse / fine) / std::log(4.0);
  RecordProperty("order", std::to_string(order));
  EXPECT_GT(order, kLowestOrder) << coarse << " at 0.1, " << fine << " at 0.025";
}

INSTANTIATE_TEST_SUITE_P(Shapes, SmoothFieldOn,
                         testing::Values(Shape{"quad", kQuad}, Shape{"skew_quad", kBentQuad},
                                         Shape{"triangle", kTriangle},
                                         Shape{"pentagon", kPentagon}),
                         [](const auto& shape) { return shape.param.name; });

TEST(SmoothField, DoesNotMixAcrossABuriedStrip) {
  // The strip 0.4 < x < 0.6 is buried; the field is 1 to its left and 100 to its right.
  const PatchMesh mesh = mesh_of(kQuad, 0.1);
  std::vector<char> usable(mesh.size(), 1);
  BandMatrix means(static_cast<Eigen::Index>(mesh.size()), 1);
  for (std::size_t i = 0; i < mesh.size(); ++i) {
    const double x = mesh.patches[i].centroid.x();
    usable[i] = x < 0.4 || x > 0.6;
    means(static_cast<Eigen::Index>(i), 0) = x < 0.4 ? 1.0 : x > 0.6 ? 100.0 : 0.0;
  }
  const SmoothField field(mesh, usable, means);
  Eigen::VectorXd value(1);
  for (double y = 0.05; y < 1.0; y += 0.1)
    for (double x : {0.01, 0.33, 0.399, 0.601, 0.7, 0.99}) {
      const Vec3 point(x, y, 0.0);
      field.evaluate(field.find_patch(0, point), point, value);
      const double expected = x < 0.5 ? 1.0 : 100.0;
      EXPECT_NEAR(value[0], expected, expected * kRounding) << x << ", " << y;
    }
}

TEST(SmoothField, KeepsAJumpAlongAContactLine) {
  // A thin wall on the floor, x = 0.5 for all y: left 1, right 100.
  Scene scene = tiny::grey_scene(0.5);
  tiny::add_surface(scene, "floor", kQuad);
  tiny::add_surface(scene, "wall", {{0.5, 0, 0}, {0.5, 1, 0}, {0.5, 1, 1}, {0.5, 0, 1}});
  const PatchMesh mesh = uniform_mesh(scene, 0.09);
  BandMatrix means = BandMatrix::Zero(static_cast<Eigen::Index>(mesh.size()), 1);
  for (std::uint32_t i = 0; i < mesh.pieces[0].patch_count; ++i)
    means(i, 0) = mesh.patches[i].centroid.x() < 0.5 ? 1.0 : 100.0;
  const SmoothField field(mesh, std::vector<char>(mesh.size(), 1), means);
  Eigen::VectorXd value(1);
  for (double x : {0.45, 0.499, 0.501, 0.55}) {
    field.evaluate(field.find_patch(0, {x, 0.4, 0}), {x, 0.4, 0}, value);
    const double expected = x < 0.5 ? 1.0 : 100.0;
    EXPECT_NEAR(value[0], expected, expected * kRounding) << x;
  }
}

}  // namespace
}  // namespace truebox

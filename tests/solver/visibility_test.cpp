// SPDX-License-Identifier: BSD-3-Clause
#include "transport/visibility.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "radiometry/table_file.h"
#include "support/tiny_scenes.h"
#include "transport/gather.h"
#include "transport/quadrature.h"

namespace truebox {
namespace {

constexpr double kQuadrature = 1e-6;  // relative: what the subdivided Gauss rule is asked for

// "[(0,0,.5) (.5,0,.5) ...]"
Polygon polygon_after(const std::string& text, const std::string& label) {
  Polygon polygon;
  const std::size_t start = text.find(label), end = text.find(']', start);
  for (std::size_t at = text.find('(', start); at < end; at = text.find('(', at + 1)) {
    const char* cursor = text.c_str() + at + 1;
    Vec3 v;
    for (int k = 0; k < 3; ++k) {
      char* next = nullptr;
      v[k] = std::strtod(cursor, &next);
      cursor = next + 1;
    }
    polygon.push_back(v);
  }
  return polygon;
}

// Mean over [x0, x0 + size]^2 of a function, 4 x 4 Gauss points, split until two levels agree.
double adaptive_mean(const std::function<double(double, double)>& f, double x0, double y0,
                     double size, double tolerance, int depth) {
  const GaussRule& rule = gauss_rule(4);
  const auto rule_mean = [&](double u, double v, double edge) {
    double sum = 0.0;
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j)
        sum += rule.weights[i] * rule.weights[j] *
               f(u + edge * rule.nodes[i], v + edge * rule.nodes[j]);
    return sum;
  };
  const double h = 0.5 * size;
  const double whole = rule_mean(x0, y0, size);
  const double parts = 0.25 * (rule_mean(x0, y0, h) + rule_mean(x0 + h, y0, h) +
                               rule_mean(x0, y0 + h, h) + rule_mean(x0 + h, y0 + h, h));
  if (depth >= 9 || (depth > 1 && std::abs(whole - parts) < tolerance)) return parts;
  double sum = 0.0;
  for (int k = 0; k < 4; ++k)
    sum += adaptive_mean(f, x0 + (k & 1) * h, y0 + (k >> 1) * h, h, tolerance, depth + 1);
  return 0.25 * sum;
}

TEST(Visibility, ATwoSidedSheetShowsAFrontToEitherSide) {
  Scene scene = tiny::grey_scene(0.5);
  const Polygon sheet{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  scene.surfaces.push_back(
      {"sheet", 0, {sheet, Polygon(sheet.rbegin(), sheet.rend())}, false, true});
  tiny::add_surface(scene, "one-sided", {{2, 0, 0}, {3, 0, 0}, {3, 1, 0}, {2, 1, 0}});
  const PatchMesh mesh = uniform_mesh(scene, 0.5);
  const Visibility visibility(mesh, scene);
  for (const double side : {1.0, -1.0}) {
    const auto hit = visibility.first_hit({0.3, 0.4, side}, {0, 0, -side});
    ASSERT_TRUE(hit);
    EXPECT_TRUE(hit->front);
    EXPECT_GT(mesh.pieces[hit->piece].plane.normal.z() * side, 0.0);
  }
  const auto back = visibility.first_hit({2.3, 0.4, -1.0}, {0, 0, 1});
  ASSERT_TRUE(back);
  EXPECT_FALSE(back->front);  // no other side was asked for
}

TEST(VisibleFactor, ReproducesOccludedViewFactors) {
  const TableFile table =
      read_table(std::string(TRUEBOX_REFERENCE_DIR) + "/analytic/view_factors.csv");
  int rows = 0;
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    const std::string& text = table.rows[row][1];
    if (text.find("blocker [") == std::string::npos) continue;
    // Halving squares does not resolve penumbrae and slits of 1e-3 and 1e-6.
    const std::string& name = table.rows[row][0];
    if (name.starts_with("occl_1e-") || name.starts_with("occl_slit_")) continue;
    ++rows;
    Scene scene = tiny::grey_scene(0.5);
    tiny::add_surface(scene, "receiver", polygon_after(text, "A1"));
    tiny::add_surface(scene, "source", polygon_after(text, "A2"));
    tiny::add_surface(scene, "blocker", polygon_after(text, "blocker"));
    const PatchMesh mesh = uniform_mesh(scene, 10.0);
    const Gather gather(mesh, scene, true);
    Gather::Scratch scratch;
    const auto at = [&](double x, double y) {
      return gather.visible_factor({x, y, 0}, Vec3::UnitZ(), mesh.pieces[1].polygon, 1, scratch);
    };
    const double certified = table.number(row, table.column_index("value"));
    EXPECT_NEAR(adaptive_mean(at, 0, 0, 1, kQuadrature * certified, 0) / certified, 1.0,
                kQuadrature)
        << table.rows[row][0];
  }
  EXPECT_EQ(rows, 3);
}

TEST(VisibleFactor, HiddenAndSeenPartsAddUp) {
  // The ceiling seen from the floor past a block, and what the block's own sides take of the view:
  // all visible factors of a closed scene sum to 1.
  const Scene scene = tiny::cube_with_block(1.0, 0.5);
  const PatchMesh mesh = uniform_mesh(scene, 10.0);
  const Gather gather(mesh, scene, true);
  Gather::Scratch scratch;
  std::mt19937_64 random(41);
  std::uniform_real_distribution<double> uniform(0.01, 0.99);
  for (int trial = 0; trial < 200; ++trial) {
    const Vec3 point(uniform(random), uniform(random), 0.0);
    if (point.x() > 0.3 && point.x() < 0.6 && point.y() > 0.36 && point.y() < 0.67) continue;
    double sum = 0.0;
    for (std::uint32_t p = 0; p < mesh.pieces.size(); ++p)
      sum += gather.visible_factor(point, Vec3::UnitZ(), mesh.pieces[p].polygon, p, scratch);
    EXPECT_NEAR(sum, 1.0, 1e-9) << point.transpose();  // clip tolerance, 1e-9 of the scene
  }
}

TEST(Visibility, NoRayLeavesAClosedBox) {
  for (double edge : {1.0, 1e-6, 1e6}) {
    const Scene scene = tiny::cube(edge, 0.5);
    const PatchMesh mesh = uniform_mesh(scene, 0.25 * edge);
    const Visibility visibility(mesh, scene);
    std::mt19937_64 random(42);
    std::uniform_real_distribution<double> uniform(0.001, 0.999);
    std::uniform_int_distribution<int> face(0, 2), part(0, 64);
    int escaped = 0;
    for (int trial = 0; trial < 20000; ++trial) {
      const Vec3 origin = edge * Vec3(uniform(random), uniform(random), uniform(random));
      // Aimed at an edge of the box, where two surfaces meet: the place to leak.
      Vec3 target;
      const int free = face(random);
      for (int k = 0; k < 3; ++k) target[k] = k == free ? part(random) / 64.0 : part(random) % 2;
      escaped += !visibility.first_hit(origin, (edge * target - origin).normalized());
    }
    EXPECT_EQ(escaped, 0) << edge << " m";
  }
}

TEST(Visibility, HitsLieOnThePlaneAndKnowTheirSide) {
  const Scene scene = tiny::cube_with_block(1.0, 0.5);
  const PatchMesh mesh = uniform_mesh(scene, 10.0);
  const Visibility visibility(mesh, scene);
  const auto down = visibility.first_hit({0.45, 0.5, 0.9}, -Vec3::UnitZ());
  ASSERT_TRUE(down);
  EXPECT_TRUE(down->front);
  EXPECT_NEAR(down->point.z(), 0.43, 1e-15) << "recomputed in double";
  EXPECT_NEAR(down->distance_m, 0.47, 1e-6);
  const auto from_within = visibility.first_hit({0.45, 0.5, 0.2}, Vec3::UnitZ());
  ASSERT_TRUE(from_within);
  EXPECT_FALSE(from_within->front);
}

TEST(Visibility, ABlockHidesWhatIsBehindIt) {
  const Scene scene = tiny::cube_with_block(1.0, 0.5);
  const PatchMesh mesh = uniform_mesh(scene, 10.0);
  const Visibility visibility(mesh, scene);
  EXPECT_TRUE(visibility.occluded({0, 0.5, 0.2}, Vec3::UnitX(), {1, 0.5, 0.2}, -Vec3::UnitX()));
  EXPECT_FALSE(visibility.occluded({0, 0.5, 0.6}, Vec3::UnitX(), {1, 0.5, 0.6}, -Vec3::UnitX()));
  EXPECT_FALSE(visibility.occluded({0, 0.1, 0.2}, Vec3::UnitX(), {1, 0.1, 0.2}, -Vec3::UnitX()));
}

TEST(Visibility, LightPassesAnOpening) {
  Scene scene = tiny::cube(1.0, 0.5);
  scene.surfaces[1].is_opening = true;
  std::rotate(scene.surfaces.begin() + 1, scene.surfaces.begin() + 2, scene.surfaces.end());
  const PatchMesh mesh = uniform_mesh(scene, 10.0);
  const Visibility visibility(mesh, scene);
  EXPECT_FALSE(visibility.first_hit({0.5, 0.5, 0.5}, Vec3::UnitZ()));
  EXPECT_TRUE(visibility.first_hit({0.5, 0.5, 0.5}, Vec3::UnitZ(), true));
}

}  // namespace
}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "transport/view_factors.h"
#include "verification/basis_checks.h"
#include "verification/view_factor_scenes.h"

namespace truebox {
namespace {

struct Group {
  std::string name;
  std::function<std::vector<AccuracyCheck>(const std::filesystem::path&)> check;
  std::size_t count;  // at least
  double digits;      // at least, in every check
};

class CertifiedValues : public testing::TestWithParam<Group> {};

TEST_P(CertifiedValues, AreReproducedInDigits) {
  const auto checks = GetParam().check(TRUEBOX_REFERENCE_DIR);
  ASSERT_GE(checks.size(), GetParam().count);
  double fewest = 16.0;
  for (const AccuracyCheck& c : checks) {
    EXPECT_TRUE(c.passed()) << c.name << ": " << c.computed << ", certified " << c.certified
                            << ", allowed " << c.allowed << " (" << c.reason << ")";
    EXPECT_EQ(c.group, GetParam().name);
    fewest = std::min(fewest, matching_digits(c.computed, c.certified));
  }
  EXPECT_GE(fewest, GetParam().digits);
  std::printf("%s: %zu checks, fewest digits %.1f\n", GetParam().name.c_str(), checks.size(),
              fewest);
}

// Fewest digits: view factors past a blocker are asked for six, the others for nine, by what each
// check allows; the furnace at rho = 1 - 1e-6 amplifies rounding by 1e6 twice over; plates with
// gap 1e-8 lose 2e-8 of their view, amplified by 1 / (1 - rho); probes carry Monte Carlo noise;
// in the tip of a narrow bright wedge B rises like x^0.3, and the shortest element decides.
INSTANTIATE_TEST_SUITE_P(Groups, CertifiedValues,
                         testing::Values(Group{"viewfactors", check_view_factors, 20, 6.0},
                                         Group{"furnace", check_furnace, 10, 9.0},
                                         Group{"plates", check_infinite_plates, 6, 5.0},
                                         Group{"bases", check_strips, 136, 5.0},
                                         Group{"cube", check_ceiling_lit_cube, 12, 10.0},
                                         Group{"cie171", check_cie171, 40, 9.0}),
                         [](const auto& group) { return group.param.name; });

// The smallest length that a view factor of these polygons can hang on: edges, widths, gaps between
// corners, heights over each other's planes. What touches has none.
double smallest_length(const std::vector<SceneOutline>& outlines) {
  double smallest = std::numeric_limits<double>::infinity();
  const auto count = [&](double length) {
    if (length > 1e-9) smallest = std::min(smallest, length);
  };
  for (const SceneOutline& a : outlines)
    for (const SceneOutline& b : outlines)
      for (std::size_t k = 0; k < b.outline.size(); ++k) {
        const Vec3 &p = b.outline[k], along = b.outline[(k + 1) % b.outline.size()] - p;
        count(std::abs(plane_of(a.outline).distance_m(p)));
        for (const Vec3& v : a.outline) {
          count((v - p).norm());
          if (&a == &b) count((v - p).cross(along.normalized()).norm());
        }
      }
  return smallest;
}

TEST(CertifiedViewFactors, AreTheSameTurnedScaledAndFarAway) {
  // Far away, 1e6 sizes of the scene, coordinates are rounded to u: view factors follow them with a
  // slope of some units over the smallest length of the row, and no program can do better.
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.83, Vec3(0.3, -0.5, 0.8).normalized()).toRotationMatrix();
  std::size_t rows = 0;
  for (const CertifiedScene& row : view_factor_scenes(TRUEBOX_REFERENCE_DIR)) {
    if (row.relative_model_error > 1e-8) continue;  // round shapes: another polygon each time
    ++rows;
    const Scene original = scene_of(row.outlines);
    const auto expect_same = [&](double scale, const Vec3& shift, double allowed) {
      Scene moved = original;
      for (Surface& surface : moved.surfaces)
        for (Polygon& piece : surface.pieces)
          for (Vec3& v : piece) v = scale * (turn * v) + shift;
      const ViewFactors factors(moved);
      const double found =
          factors.between(0, 1, {}).exchange_area_m2 / factors.area_m2(0) / row.view_factor;
      EXPECT_NEAR(found, 1.0, allowed) << row.name << ", scale " << scale << ", " << shift.norm();
    };
    for (double scale : {1e-6, 1e6}) expect_same(scale, Vec3::Zero(), 2e-9);
    const double size = original.diameter_m();
    const double u = 1e6 * size * std::numeric_limits<double>::epsilon();
    expect_same(1.0, 1e6 * size * Vec3(0.6, -0.2, 0.3),
                2e-9 + 8.0 * u / smallest_length(row.outlines));
  }
  EXPECT_GE(rows, 35u);
}

TEST(CubeContinuum, IsReachedToAMillionth) {
  // The certified means are good to 2e-7.
  const auto checks = check_cube_continuum(TRUEBOX_REFERENCE_DIR);
  EXPECT_EQ(checks.size(), 8u);
  for (const AccuracyCheck& c : checks) {
    EXPECT_TRUE(c.passed()) << c.name << ": " << c.computed << ", " << c.reason;
    EXPECT_LE(std::abs(c.computed / c.certified - 1.0), 1e-6) << c.name << ", bound " << c.allowed;
    EXPECT_LE(c.allowed, 4e-6 * c.certified) << "a bound that says something";
  }
}

TEST(AccuracyCheck, FailsOnANumberThatIsNone) {
  AccuracyCheck check{"g", "n", std::nan(""), 1.0, 1.0, "1", ""};
  EXPECT_FALSE(check.passed());
  EXPECT_EQ(matching_digits(std::nan(""), 1.0), 0.0);
  check.computed = 2.0 + 1e-9;
  EXPECT_FALSE(check.passed());
  EXPECT_NEAR(matching_digits(1.001, 1.0), 3.0, 1e-9);
}

}  // namespace
}  // namespace truebox

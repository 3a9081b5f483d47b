// SPDX-License-Identifier: BSD-3-Clause
#include "transport/form_factors.h"

#include <gmock/gmock.h>

#include <cmath>
#include <stdexcept>

#include "support/tiny_scenes.h"
#include "transport/form_factor.h"

namespace truebox {
namespace {

using testing::HasSubstr;

FormFactors factors_of(const Scene& scene, double edge, const FormFactorOptions& options) {
  const PatchMesh mesh = uniform_mesh(scene, edge);
  return form_factors(mesh, scene, Visibility(mesh, scene), options);
}

FormFactorOptions exact() {
  FormFactorOptions options;
  options.relative_tolerance = 1e-13;
  options.occlusion = false;
  return options;
}

FormFactorOptions by_rays(std::uint64_t seed = 1) {
  FormFactorOptions options;
  options.method = FormFactorMethod::ray_casting;
  options.seed = seed;
  return options;
}

TEST(FormFactors, AreReciprocalToTheLastBit) {
  for (const Scene& scene : {tiny::cube(1.0, 0.5), tiny::cube_with_block(1.0, 0.5)})
    for (const FormFactorOptions& options : {FormFactorOptions{}, by_rays()}) {
      const auto s = factors_of(scene, 0.2, options).exchange_area_m2;
      EXPECT_EQ((s - s.transpose()).cwiseAbs().maxCoeff(), 0.0);
      EXPECT_GE(s.minCoeff(), 0.0);
    }
}

TEST(FormFactors, CloseAConvexCube) {
  const FormFactors f = factors_of(tiny::cube(1.0, 0.5), 0.125, exact());
  for (Eigen::Index i = 0; i < f.size(); ++i)
    EXPECT_NEAR(f.exchange_area_m2.col(i).sum() / f.area_m2[i], 1.0, 1e-10) << i;
  EXPECT_TRUE(f.summary.closed);
  EXPECT_EQ(f.summary.pairs_sampled, 0u);
  EXPECT_LT(f.summary.closure_error_max, 1e-10);
  EXPECT_NEAR(f.summary.row_sum_max, 1.0, 1e-10);
}

TEST(FormFactors, HoldTheToleranceAskedFor) {
  const Scene cube = tiny::cube(1.0, 0.5);
  FormFactorOptions loose = exact();
  loose.relative_tolerance = 1e-5;
  const auto rough = factors_of(cube, 0.2, loose).exchange_area_m2;
  const auto fine = factors_of(cube, 0.2, exact()).exchange_area_m2;
  double worst = 0.0;
  for (Eigen::Index i = 0; i < rough.size(); ++i)
    if (fine.data()[i] > 0.0)
      worst = std::max(worst, std::abs(rough.data()[i] / fine.data()[i] - 1.0));
  EXPECT_LT(worst, 1e-5);
  EXPECT_GT(worst, 0.0) << "the option does nothing";
}

TEST(FormFactors, ClosedSceneWithABlockIsRepairedToUnity) {
  const FormFactors f = factors_of(tiny::cube_with_block(1.0, 0.5), 0.12, by_rays());
  EXPECT_TRUE(f.summary.closed);
  EXPECT_GT(f.summary.pairs_sampled, 0u);
  EXPECT_GT(f.summary.closure_error_max, 1e-6) << "sampling leaves something to repair";
  EXPECT_LT(f.summary.closure_error_mean, 0.01)
      << "unrepaired: a few rays a pair, many pairs a row";
  EXPECT_LT(f.summary.closure_residual_max, 1e-4);
}

TEST(FormFactors, LeastSquaresChangesLessThanScalingAndClosesAsWell) {
  const Scene scene = tiny::cube_with_block(1.0, 0.5);
  FormFactorOptions options = by_rays();
  const FormFactors scaled = factors_of(scene, 0.2, options);
  options.repair = ClosureRepair::least_squares;
  const FormFactors changed = factors_of(scene, 0.2, options);
  options.repair = ClosureRepair::none;
  const FormFactors left = factors_of(scene, 0.2, options);
  EXPECT_EQ(left.summary.repair_max, 0.0);
  EXPECT_EQ(left.summary.closure_residual_max, left.summary.closure_error_max);
  EXPECT_EQ(changed.summary.closure_error_max, left.summary.closure_error_max);
  EXPECT_LT(changed.summary.closure_residual_max, 1e-4) << "as rows that are scaled";
  // The sum of squared relative changes is what it minimises.
  EXPECT_GT(changed.summary.repair_rms, 0.0);
  EXPECT_LE(changed.summary.repair_rms, scaled.summary.repair_rms);
}

TEST(FormFactors, RepairTouchesSampledEntriesOnly) {
  const Scene scene = tiny::cube_with_block(1.0, 0.5);
  const PatchMesh mesh = uniform_mesh(scene, 0.2);
  const FormFactors f = form_factors(mesh, scene, Visibility(mesh, scene), by_rays());
  ASSERT_GT(f.summary.repair_max, 0.0);
  Polygon a, b;
  std::size_t kernel_alone = 0, pairs = 0;
  for (Eigen::Index i = 0; i < f.size(); ++i)
    for (Eigen::Index j = i + 1; j < f.size(); ++j) {
      if (f.exchange_area_m2(i, j) == 0.0) continue;
      ++pairs;
      mesh.polygon_of(mesh.patches[static_cast<std::size_t>(i)], a);
      mesh.polygon_of(mesh.patches[static_cast<std::size_t>(j)], b);
      const double kernel = exchange_area_m2(PlanarPolygon(a), PlanarPolygon(b),
                                             FormFactorOptions{}.relative_tolerance);
      kernel_alone += f.exchange_area_m2(i, j) == kernel;
    }
  EXPECT_EQ(pairs, f.summary.pairs_unoccluded + f.summary.pairs_sampled);
  EXPECT_GE(kernel_alone, f.summary.pairs_unoccluded * 99 / 100)
      << "buried pairs aside, what nothing can hide is the kernel to the last bit";
  EXPECT_LT(kernel_alone, pairs);
}

TEST(FormFactors, ElementsUnderABlockAreBuried) {
  const Scene scene = tiny::cube_with_block(1.0, 0.5);
  const PatchMesh mesh = uniform_mesh(scene, 0.13);
  const FormFactors f = form_factors(mesh, scene, Visibility(mesh, scene), {});
  std::size_t buried = 0;
  for (std::size_t i = 0; i < mesh.size(); ++i) {
    const Vec3& c = mesh.patches[i].centroid;
    const bool under_block =
        c.z() == 0.0 && c.x() > 0.31 && c.x() < 0.58 && c.y() > 0.37 && c.y() < 0.66;
    buried += under_block;
    EXPECT_EQ(f.usable[i] == 0, under_block) << c.transpose();
    if (under_block) {
      EXPECT_EQ(f.exchange_area_m2.row(static_cast<Eigen::Index>(i)).sum(), 0.0);
    }
  }
  EXPECT_EQ(f.summary.buried_patches, buried);
}

TEST(FormFactors, OpenSceneIsNotRepaired) {
  Scene scene = tiny::cube_with_block(1.0, 0.5);
  scene.surfaces.erase(scene.surfaces.begin() + 1);  // no ceiling
  const FormFactors f = factors_of(scene, 0.2, {});
  EXPECT_FALSE(f.summary.closed);
  EXPECT_EQ(f.summary.repair_max, 0.0);
}

TEST(FormFactors, RefuseWhatDoesNotFitTheMemory) {
  FormFactorOptions options;
  options.memory_limit_bytes = std::size_t{1} << 20;
  try {
    factors_of(tiny::cube(1.0, 0.5), 0.05, options);  // 2400 elements
    FAIL() << "2400^2 doubles were fitted into 1 MiB";
  } catch (const std::length_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("2400 elements"));
    EXPECT_THAT(error.what(), HasSubstr("43 MiB"));
    EXPECT_THAT(error.what(), HasSubstr("1 MiB"));
    EXPECT_THAT(error.what(), HasSubstr("362 elements"));
  }
}

TEST(FormFactors, AreTheSameForTheSameSeedOfRays) {
  const Scene scene = tiny::cube_with_block(1.0, 0.5);
  const auto a = factors_of(scene, 0.2, by_rays()).exchange_area_m2;
  const auto difference = [&](const FormFactorOptions& options) {
    return (a - factors_of(scene, 0.2, options).exchange_area_m2).cwiseAbs().maxCoeff();
  };
  EXPECT_EQ(difference(by_rays()), 0.0);
  EXPECT_GT(difference(by_rays(2)), 0.0);
}

TEST(FormFactors, NeedNoSeedWhereOutlinesDecide) {
  const Scene scene = tiny::cube_with_block(1.0, 0.5);
  FormFactorOptions other;
  other.seed = 2;
  const auto a = factors_of(scene, 0.2, {}).exchange_area_m2;
  EXPECT_EQ((a - factors_of(scene, 0.2, other).exchange_area_m2).cwiseAbs().maxCoeff(), 0.0);
}

}  // namespace
}  // namespace truebox

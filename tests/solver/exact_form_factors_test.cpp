// SPDX-License-Identifier: BSD-3-Clause
#include "transport/exact_form_factors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <mutex>
#include <numeric>
#include <stdexcept>

#include "scene/scene_file.h"
#include "support/brute_force_rows.h"
#include "support/tiny_scenes.h"
#include "transport/pair_kernel.h"

namespace truebox {
namespace {

ExactFormFactorOptions with_points(int points, double tolerance = 1e-5) {
  ExactFormFactorOptions options;
  options.outline_points = points;
  options.relative_tolerance = tolerance;
  return options;
}

TEST(ExactFormFactors, CloseAnEmptyCubeToTheKernelsTolerance) {
  const Scene cube = tiny::cube(1.0, 0.0);
  const PatchMesh mesh = uniform_mesh(cube, 0.125);
  for (double tolerance : {1e-3, 1e-5, 1e-8}) {
    const auto f = exact_form_factors<double>(mesh, cube, with_points(3, tolerance));
    EXPECT_EQ(f.pairs_partial, 0u);
    EXPECT_LT(f.closure_rms(), tolerance);
  }
}

TEST(ExactFormFactors, CloseARoomWithABlock) {
  // Tolerance of adaptive visibility; each row has some hundred pairs whose errors partly cancel.
  const Scene scene = tiny::cube_with_block(1.0, 0.0);
  const PatchMesh mesh = uniform_mesh(scene, 0.2);
  const auto adaptive = exact_form_factors<double>(mesh, scene, with_points(0, 1e-6));
  EXPECT_GT(adaptive.pairs_partial, 100u);
  EXPECT_GT(adaptive.pairs_hidden, 100u);
  EXPECT_LT(adaptive.closure_rms(), 1e-6);
  double previous = 1.0;
  for (int points : {2, 3, 4}) {
    const double rms = exact_form_factors<double>(mesh, scene, with_points(points)).closure_rms();
    EXPECT_LT(rms, previous) << "more points, better";
    EXPECT_LT(rms, 5e-3) << points;
    previous = rms;
  }
}

TEST(ExactFormFactors, SeeBothSidesOfASheetHide) {
  // Both sides share all edges, in one plane: no solid, or light would pass. Where a sheet hides
  // nothing rows sum to more than one, by what it takes up of their view.
  Scene scene = tiny::cube(1.0, 0.0);
  const Polygon sheet{{0.3, 0.2, 0.4}, {0.8, 0.2, 0.4}, {0.8, 0.8, 0.4}, {0.3, 0.8, 0.4}};
  scene.surfaces.push_back(
      {"sheet", 0, {sheet, Polygon(sheet.rbegin(), sheet.rend())}, false, true});
  const PatchMesh mesh = uniform_mesh(scene, 0.2);
  const auto f = exact_form_factors<double>(mesh, scene, with_points(0, 1e-6));
  EXPECT_GT(f.pairs_partial, 100u);
  EXPECT_LT(f.closure_rms(), 1e-6);
}

TEST(ExactFormFactors, AgreeWithBruteForceRowByRow) {
  // Brute force finds a shadow's edge to some 1/16^1.5, and a tenth of the row is partly hidden:
  // 2e-3. Nine points a pair are worse by (16/3)^1.5 at most.
  const Scene scene = tiny::cube_with_block(1.0, 0.0);
  const PatchMesh mesh = uniform_mesh(scene, 0.25);
  const std::vector<PlanarPolygon> patches = planar_polygons(mesh);
  const auto adaptive = exact_form_factors<double>(mesh, scene, with_points(0, 1e-6));
  const auto quick = exact_form_factors<double>(mesh, scene, with_points(3));
  for (std::uint32_t i : {0u, 9u, 40u, 77u, 90u}) {
    EXPECT_LT(row_difference(mesh, patches, adaptive.exchange_area_m2, i), 2e-3) << i;
    EXPECT_LT(row_difference(mesh, patches, quick.exchange_area_m2, i), 2e-2) << i;
  }
}

TEST(ExactFormFactors, CloseTheRoomWithTwoBlocksToABillionth) {
  // The closed box cut into 223 patches: rows must sum to 1 to the tolerance asked for, whichever
  // blocks meet in front of each other. A row has some 100 partly hidden pairs, each allowed a
  // tenth of the tolerance: ten times the tolerance at most.
  const Scene scene =
      read_scene(std::string(TRUEBOX_REFERENCE_DIR) + "/independent_renders/closed_box.toml");
  const PatchMesh mesh = uniform_mesh(scene, edge_for_count(scene, 200));
  std::vector<double> off;
  std::mutex lock;
  // Rows of the floor between the blocks and of the wall behind them.
  for (std::size_t begin : {32u, 157u})
    stream_form_factors(
        mesh, scene, with_points(0, 1e-9), begin, begin + 6, [&](const FormFactorRow& row) {
          const std::lock_guard guard(lock);
          const double sum =
              std::accumulate(row.exchange_area_m2.begin(), row.exchange_area_m2.end(), 0.0) /
              mesh.patches[row.patch].area_m2;
          if (sum > 1e-4) off.push_back(std::abs(sum - 1.0));  // not buried
        });
  ASSERT_GE(off.size(), 8u);
  double squares = 0.0;
  for (double error : off) squares += error * error;
  EXPECT_LT(std::sqrt(squares / static_cast<double>(off.size())), 1e-9);
  EXPECT_LT(*std::max_element(off.begin(), off.end()), 1e-8);
}

TEST(ExactFormFactors, FloatsCostTheirRounding) {
  const Scene scene = tiny::cube_with_block(1.0, 0.0);
  const PatchMesh mesh = uniform_mesh(scene, 0.3);
  const auto in_double = exact_form_factors<double>(mesh, scene, with_points(3));
  const auto in_float = exact_form_factors<float>(mesh, scene, with_points(3));
  const auto n = in_double.area_m2.size();
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j) {
      const double value = in_double.exchange_area_m2(i, j);
      EXPECT_NEAR(in_float.exchange_area_m2(i, j), value, 6e-8 * value);
      EXPECT_EQ(value, in_double.exchange_area_m2(j, i));
    }
}

TEST(ExactFormFactors, StreamTheRowsOfTheMatrix) {
  const Scene scene = tiny::cube_with_block(1.0, 0.0);
  const PatchMesh mesh = uniform_mesh(scene, 0.25);
  const auto matrix = exact_form_factors<double>(mesh, scene, with_points(3));
  std::mutex lock;
  std::size_t rows = 0;
  stream_form_factors(mesh, scene, with_points(3), [&](std::size_t i, auto row) {
    const std::lock_guard guard(lock);
    ++rows;
    for (std::size_t j = 0; j < row.size(); ++j) {
      const double value =
          matrix.exchange_area_m2(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      EXPECT_EQ(row[j], value) << i << ' ' << j;
    }
  });
  EXPECT_EQ(rows, mesh.size());
}

TEST(ExactFormFactors, RefuseWhatDoesNotFitTheMemory) {
  const Scene cube = tiny::cube(1.0, 0.0);
  const PatchMesh mesh = uniform_mesh(cube, 0.1);  // 600 patches: 2.7 MiB in doubles
  const std::size_t limit = std::size_t{2} << 20;
  EXPECT_THROW(exact_form_factors<double>(mesh, cube, {}, limit), std::length_error);
  EXPECT_NO_THROW(exact_form_factors<float>(mesh, cube, {}, limit));
}

TEST(PairKernel, HoldsItsTolerance) {
  // Every pair of a cube's patches, near and far, against the closed form.
  const Scene cube = tiny::cube(1.0, 0.0);
  const PatchMesh mesh = uniform_mesh(cube, 0.2);
  const std::vector<PlanarPolygon> patches = planar_polygons(mesh);
  std::vector<std::uint32_t> order(patches.size());
  std::iota(order.begin(), order.end(), 0u);
  for (double tolerance : {1e-2, 1e-4, 1e-7}) {
    const PairKernel kernel(patches, order, tolerance, 1e-12);
    for (std::uint32_t i = 0; i < patches.size(); i += 3)
      for (std::uint32_t j = 0; j < patches.size(); ++j) {
        if (mesh.patches[i].piece == mesh.patches[j].piece) continue;
        const double exact = exchange_area_m2(patches[i], patches[j], 1e-13);
        EXPECT_NEAR(kernel.exchange_area_m2(i, j), exact, tolerance * exact) << i << ' ' << j;
      }
  }
}

TEST(PairKernel, FindsTheSameBitsOneByOneAndInRuns) {
  // The other walls' patches in runs of a length that eight does not divide, from below and above.
  const Scene cube = tiny::cube(1.0, 0.0);
  const PatchMesh mesh = uniform_mesh(cube, 0.21);
  const std::vector<PlanarPolygon> patches = planar_polygons(mesh);
  std::vector<std::uint32_t> order(patches.size());
  std::iota(order.begin(), order.end(), 0u);
  for (double tolerance : {1e-2, 1e-4, 1e-7}) {
    const PairKernel kernel(patches, order, tolerance, 1e-12);
    for (std::uint32_t i = 0; i < patches.size(); i += 7)
      for (std::size_t p = 0; p < mesh.pieces.size(); ++p) {
        if (p == mesh.patches[i].piece) continue;
        const Piece& piece = mesh.pieces[p];
        std::vector<double> run(piece.patch_count - 1);
        kernel.exchange_areas_m2(i, piece.first_patch, true, run);
        for (std::uint32_t k = 0; k < run.size(); ++k)
          EXPECT_EQ(run[k], kernel.exchange_area_m2(i, piece.first_patch + k)) << i << ' ' << k;
      }
  }
}

}  // namespace
}  // namespace truebox

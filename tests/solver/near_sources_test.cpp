// SPDX-License-Identifier: BSD-3-Clause
#include "transport/near_sources.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/tiny_scenes.h"
#include "transport/prediction.h"

namespace truebox {
namespace {

using Eigen::Index;

TEST(NearSources, LeaveAFurnaceAlone) {
  const Scene scene = tiny::cube_with_block(1.0, 0.5, 1.0);
  const PatchMesh mesh = uniform_mesh(scene, 0.25);
  const Gather gather(mesh, scene, true);
  const auto n = static_cast<Index>(mesh.size());
  Eigen::VectorXd area_m2(n);
  for (Index i = 0; i < n; ++i) area_m2[i] = mesh.patches[static_cast<std::size_t>(i)].area_m2;
  // Everything sends 2 wherever it is seen from: own exitance 1, half of an irradiance of 2.
  const BandMatrix missing =
      near_source_correction(mesh, scene, gather, std::vector<char>(mesh.size(), 1), area_m2,
                             BandMatrix::Zero(n, 1), BandMatrix::Constant(n, 1, 2.0));
  EXPECT_LT(missing.cwiseAbs().maxCoeff(), 1e-12);
}

// Cube of reflectance 0.8 whose ceiling shines 1: certified means of ceiling_lit_cube.csv.
double error_of_surface_means(bool near_sources) {
  Scene scene = tiny::cube(1.0, 0.8);
  scene.materials.push_back({"lamp", Reflectance(1, 0.8), RadiantExitance(1, 1.0)});
  scene.surfaces[1].material = 1;
  PredictOptions options;
  options.elements = 96;
  options.near_sources = near_sources;
  const Prediction prediction(scene, options);
  const double certified[] = {0.660979 / 0.8, 0.587506 / 0.8, 0.68787875 / 0.8};
  const PatchMesh& mesh = prediction.fine().mesh;
  const BandMatrix irradiance = prediction.irradiance();
  double mean[6] = {}, squares = 0.0;
  for (std::size_t i = 0; i < mesh.size(); ++i)
    mean[mesh.surface_of(mesh.patches[i])] +=
        mesh.patches[i].area_m2 * irradiance(static_cast<Index>(i), 0);
  for (std::size_t s = 0; s < 6; ++s)
    squares += std::pow(mean[s] / certified[std::min<std::size_t>(s, 2)] - 1.0, 2);
  return std::sqrt(squares / 6.0);
}

TEST(NearSources, TakeMostOfTheErrorOffTheMeansOfALitCube) {
  const double without = error_of_surface_means(false), with = error_of_surface_means(true);
  std::printf("rms error of the means: %.2e, with near sources %.2e\n", without, with);
  EXPECT_LT(with, 0.3 * without);
}

}  // namespace
}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <cmath>
#include <cstdio>
#include <random>

#include "radiometry/table_file.h"
#include "support/tiny_scenes.h"
#include "transport/solve_radiosity.h"

namespace truebox {
namespace {

using Eigen::Index;

FormFactors cube_factors(const Scene& cube, const PatchMesh& mesh) {
  FormFactorOptions options;
  options.relative_tolerance = 1e-10;  // far below the discretisation error of the finest grid
  options.occlusion = false;
  return form_factors(mesh, cube, Visibility(mesh, cube), options);
}

// Continuum mean radiosity of a face: ceiling lit, all faces of reflectance rho.
double certified(const TableFile& table, const std::string& rho, const std::string& quantity) {
  for (std::size_t row = 0; row < table.rows.size(); ++row)
    if (table.rows[row][0] == "cube_ceiling_light" && table.rows[row][2] == quantity &&
        table.rows[row][1].find("rho=" + rho + " ") != std::string::npos)
      return table.number(row, table.column_index("value"));
  ADD_FAILURE() << "no row " << rho << ", " << quantity;
  return 0.0;
}

double face_mean(const PatchMesh& mesh, const BandMatrix& b, Index band, std::size_t face) {
  double sum = 0.0, area = 0.0;
  for (std::size_t i = 0; i < mesh.size(); ++i) {
    if (mesh.surface_of(mesh.patches[i]) != face) continue;
    sum += mesh.patches[i].area_m2 * b(static_cast<Index>(i), band);
    area += mesh.patches[i].area_m2;
  }
  return sum / area;
}

TEST(Convergence, CeilingLitCubeIsOfTheOrderItsEdgesAllow) {
  const TableFile table =
      read_table(std::string(TRUEBOX_REFERENCE_DIR) + "/analytic/ceiling_lit_cube.csv");
  const char* const faces[] = {"mean B ceiling", "mean B floor", "mean B wall"};
  const std::size_t surface[] = {1, 0, 2};
  const std::string rhos[] = {"0.5", "0.8"};
  const int grids[] = {4, 8, 16, 32};
  double error[2][3][4];
  for (int g = 0; g < 4; ++g) {
    const Scene cube = tiny::cube(1.0, 0.5);
    const PatchMesh mesh = uniform_mesh(cube, 1.0 / grids[g]);
    const FormFactors factors = cube_factors(cube, mesh);
    const auto n = static_cast<Index>(mesh.size());
    BandMatrix rho(n, 2), source = BandMatrix::Zero(n, 2), b;
    for (Index i = 0; i < n; ++i) {
      rho.row(i) << 0.5, 0.8;
      if (mesh.surface_of(mesh.patches[static_cast<std::size_t>(i)]) == 1) source.row(i).setOnes();
    }
    SolveOptions options;
    options.relative_bound = 1e-11;
    ASSERT_EQ(solve_radiosity(factors, rho, source, options, b).outcome, SolveOutcome::converged);
    for (int r = 0; r < 2; ++r)
      for (int f = 0; f < 3; ++f)
        error[r][f][g] =
            std::abs(face_mean(mesh, b, r, surface[f]) - certified(table, rhos[r], faces[f]));
  }
  std::printf(
      "error of the mean, W m^-2 nm^-1 per unit emission, N x N elements a face\n"
      "%-5s%-16s%11s%11s%11s%11s   order 4-8  8-16 16-32\n",
      "rho", "", "N=4", "8", "16", "32");
  // A 90-degree edge has B = B0 + c x^lambda with lambda = 0.763 (rho .5), 0.627 (rho .8): means
  // converge at 1 + lambda, smooth parts at 2. N=4 to 8 is not yet asymptotic for every face.
  constexpr double kLowest = 1.5, kHighest = 2.1;
  for (int r = 0; r < 2; ++r)
    for (int f = 0; f < 3; ++f) {
      const double* e = error[r][f];
      std::printf("%-5s%-16s%11.3g%11.3g%11.3g%11.3g", rhos[r].c_str(), faces[f], e[0], e[1], e[2],
                  e[3]);
      for (int g = 1; g < 4; ++g) std::printf("%8.2f", std::log2(e[g - 1] / e[g]));
      std::printf("\n");
      for (int g = 1; g < 4; ++g) {
        EXPECT_GE(std::log2(e[g - 1] / e[g]), kLowest)
            << rhos[r] << ", " << faces[f] << ", " << grids[g];
        EXPECT_LE(std::log2(e[g - 1] / e[g]), kHighest)
            << rhos[r] << ", " << faces[f] << ", " << grids[g];
      }
    }
}

TEST(ManufacturedSolution, IsRecoveredWithinTheSolverBound) {
  // Choose B, set M = B - rho F B; what comes back must be B.
  for (const bool has_block : {false, true}) {
    const Scene scene = has_block ? tiny::cube_with_block(1.0, 0.5) : tiny::cube(1.0, 0.5);
    const PatchMesh mesh = uniform_mesh(scene, 0.15);
    FormFactorOptions form_factor_options;
    form_factor_options.occlusion = has_block;
    const FormFactors f = form_factors(mesh, scene, Visibility(mesh, scene), form_factor_options);
    const Index n = f.size();
    std::mt19937_64 random(61);
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    BandMatrix chosen(n, 3), rho(n, 3), b;
    for (Index i = 0; i < n; ++i)
      for (Index k = 0; k < 3; ++k) {
        chosen(i, k) = 1.0 + uniform(random);
        rho(i, k) = k == 0 ? 0.3 : k == 1 ? 0.95 * uniform(random) : 0.98;
      }
    BandMatrix source = f.exchange_area_m2 * chosen;
    for (Index i = 0; i < n; ++i)
      source.row(i) = chosen.row(i) - rho.row(i).cwiseProduct(source.row(i)) / f.area_m2[i];
    for (const SolveMethod method : {SolveMethod::conjugate_gradient, SolveMethod::gauss_seidel})
      for (const double bound : {1e-3, 1e-9}) {
        SolveOptions options;
        options.method = method;
        options.relative_bound = bound;
        options.iteration_limit = 20000;
        const SolveSummary summary = solve_radiosity(f, rho, source, options, b);
        ASSERT_EQ(summary.outcome, SolveOutcome::converged);
        for (Index k = 0; k < 3; ++k) {
          // Rounding of M, 1e-16 a term, is amplified by 1 / (1 - rho) = 50.
          constexpr double kRounding = 1e-12;
          const double error = (b.col(k) - chosen.col(k)).cwiseAbs().maxCoeff();
          EXPECT_LE(error, summary.error_bound[k] + kRounding) << bound;
          EXPECT_LE(summary.error_bound[k], bound * b.col(k).maxCoeff() * (1.0 + 1e-12));
        }
      }
  }
}

}  // namespace
}  // namespace truebox

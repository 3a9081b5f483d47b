// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <cmath>
#include <cstdio>
#include <map>

#include "radiometry/table_file.h"
#include "support/tiny_scenes.h"
#include "transport/solve_radiosity.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr double kTargets[] = {1e-1, 1e-2, 1e-3, 1e-6, 1e-12};

// Closed cube of 12 x 12 elements a face, the 4 x 4 in the middle of its ceiling alight.
struct LitCube {
  FormFactors factors;
  BandMatrix source;

  LitCube() {
    const Scene cube = tiny::cube(1.0, 0.5);
    const PatchMesh mesh = uniform_mesh(cube, 1.0 / 12.0);
    FormFactorOptions options;
    options.relative_tolerance = 1e-13;
    options.occlusion = false;
    factors = form_factors(mesh, cube, Visibility(mesh, cube), options);
    source = BandMatrix::Zero(factors.size(), 1);
    for (std::size_t i = 0; i < mesh.size(); ++i) {
      const Vec3 at = mesh.patches[i].centroid - Vec3(0.5, 0.5, 1.0);
      if (at.cwiseAbs().maxCoeff() < 1.0 / 6.0) source(static_cast<Index>(i), 0) = 1.0;
    }
  }
};

// Work at which the error of what the solver shows first falls below each target.
std::vector<double> work_to_targets(const LitCube& box, const BandMatrix& rho,
                                    const BandMatrix& truth, SolveMethod method) {
  std::vector<double> work(std::size(kTargets), std::nan(""));
  const auto note = [&](double passes, const BandMatrix& so_far) {
    const double error = (so_far - truth).cwiseAbs().sum() / truth.cwiseAbs().sum();
    for (std::size_t t = 0; t < work.size(); ++t)
      if (error <= kTargets[t] && std::isnan(work[t])) work[t] = passes;
  };
  SolveOptions options;
  options.method = method;
  options.relative_bound = 1e-14;
  options.iteration_limit = 300;
  BandMatrix b;
  if (method != SolveMethod::gmres) {
    // Conjugate gradients start from M and its residual, a pass; the count started from darkness,
    // whose residual is M and free: as many passes.
    options.on_progress = note;
    solve_radiosity(box.factors, rho, box.source, options, b);
    return work;
  }
  for (int steps = 1; steps <= 25; ++steps) {  // what Eigen shows is the end
    options.iteration_limit = steps;
    solve_radiosity(box.factors, rho, box.source, options, b);
    note(steps + 1.0, b);  // as above
  }
  return work;
}

TEST(SolverWork, IsThatOfTheIndependentCount) {
  const TableFile table =
      read_table(std::string(TRUEBOX_REFERENCE_DIR) + "/analytic/solver_work.csv");
  const std::map<std::string, SolveMethod> methods = {
      {"Jacobi", SolveMethod::jacobi},
      {"Gauss-Seidel", SolveMethod::gauss_seidel},
      {"Southwell", SolveMethod::southwell},
      {"Southwell+ambient", SolveMethod::southwell_ambient},
      {"CG symmetrised", SolveMethod::conjugate_gradient},
      {"GMRES", SolveMethod::gmres}};
  const LitCube box;
  std::printf("passes to a relative L1 error (counted here / independently)\n%-8s%-20s", "rho", "");
  for (double target : kTargets) std::printf("%16.0e", target);
  std::printf("\n");
  int compared = 0;
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    const std::string& name = table.rows[row][0];
    if (!name.starts_with("rho=")) continue;  // the other case's materials were not recorded
    const double reflectance = std::strtod(name.c_str() + 4, nullptr);
    const SolveMethod method = methods.at(table.rows[row][2]);
    const bool krylov = method == SolveMethod::conjugate_gradient || method == SolveMethod::gmres;
    if (!krylov && reflectance > 0.9) continue;  // hundreds of passes show nothing more
    const BandMatrix rho = BandMatrix::Constant(box.factors.size(), 1, reflectance);
    SolveOptions direct;
    direct.method = SolveMethod::direct;
    direct.relative_bound = 1e-10;
    BandMatrix truth;
    ASSERT_EQ(solve_radiosity(box.factors, rho, box.source, direct, truth).outcome,
              SolveOutcome::converged);
    const std::vector<double> work = work_to_targets(box, rho, truth, method);
    std::printf("%-8g%-20s", reflectance, table.rows[row][2].c_str());
    for (std::size_t t = 0; t < work.size(); ++t) {
      const std::string& cell = table.rows[row][3 + t];
      std::printf("%8.2f /%6s", work[t], cell.c_str());
      char* end = nullptr;
      const double counted = std::strtod(cell.c_str(), &end);
      if (end == cell.c_str()) continue;  // "-": not reached there
      // Below 1e-10 the reference here carries the rounding of cond (1 + rho)/(1 - rho).
      if (kTargets[t] < 1e-10 && reflectance > 0.9) continue;
      // One step of the method; shots are ordered by ties, which may fall otherwise: 3 %.
      const bool shooting =
          method == SolveMethod::southwell || method == SolveMethod::southwell_ambient;
      const double step = shooting ? 0.03 + 0.03 * counted : 1.0;
      EXPECT_NEAR(work[t], counted, step)
          << name << ", " << table.rows[row][2] << ", " << kTargets[t];
      ++compared;
    }
    std::printf("\n");
  }
  EXPECT_GT(compared, 60);
}

}  // namespace
}  // namespace truebox

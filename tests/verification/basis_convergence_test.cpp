// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <cmath>
#include <cstdio>
#include <string>

#include "mesh/graded_mesh.h"
#include "mesh/vertex_radiosity.h"
#include "radiometry/table_file.h"
#include "support/tiny_scenes.h"
#include "transport/galerkin.h"

namespace truebox {
namespace {

using Eigen::Index;

// Moments of the unit cube's elements, integrated once; lower degrees are blocks of them.
struct Grid {
  Scene cube = tiny::cube(1.0, 0.5);
  PatchMesh mesh;
  GalerkinSystem system;

  Grid(int cells, double power, int degree)
      : mesh(graded_mesh(cube, 1.0 / cells, power)), system(mesh, cube, options(degree)) {}
  static GalerkinOptions options(int degree) {
    GalerkinOptions options;
    options.degree = degree;
    options.relative_tolerance = 1e-7;  // below the smallest error compared
    return options;
  }
};

double order(double coarse, double fine) { return std::log2(coarse / fine); }

double smooth(std::size_t, const Vec3& x) {
  return 2.0 + std::sin(1.3 * x.x() + 0.4) * std::cos(1.1 * x.y()) + 0.5 * std::cos(1.7 * x.z());
}

struct Recovered {
  Eigen::VectorXd coefficients;
  double error;
};

// Chooses B, the projection of a smooth function on the grid's highest degree, sets
// M = B - rho K B, and solves with degree p: the distance to what was chosen.
Recovered recover(const Grid& grid, int degree, double rho) {
  const Eigen::VectorXd chosen = grid.system.project(smooth);
  const Eigen::VectorXd exitance = chosen - rho * (grid.system.kernel() * chosen);
  const GalerkinSystem lower = grid.system.at_degree(degree);
  BandMatrix source(lower.unknowns(), 1), b;
  source.col(0) = exitance(grid.system.unknowns_of_degree(degree));
  EXPECT_EQ(lower.solve(BandMatrix::Constant(6, 1, rho), source, b).outcome,
            SolveOutcome::converged);
  return {b.col(0), lower.distance_to(b.col(0), smooth)};
}

// Distance of vertex radiosities, from the same elements' means, to the smooth function.
double vertex_error(const Grid& grid, const Recovered& constants, VertexRule rule) {
  const auto n = static_cast<Index>(grid.mesh.size());
  BandMatrix means(n, 1);
  for (Index i = 0; i < n; ++i)
    means(i, 0) = constants.coefficients[i] /
                  std::sqrt(grid.mesh.patches[static_cast<std::size_t>(i)].area_m2);
  const std::vector<char> usable(grid.mesh.size(), 1);
  const VertexRadiosity field(grid.mesh, usable, means, rule);
  const SmoothField finder(grid.mesh, usable, means);
  Eigen::VectorXd value(1);
  return grid.system.distance_to(
      Eigen::VectorXd::Zero(grid.system.unknowns()), [&](std::size_t face, const Vec3& x) {
        field.evaluate(finder.find_patch(static_cast<std::uint32_t>(face), x), x, value);
        return value[0] - smooth(face, x);
      });
}

// Error of the ceiling's mean when it alone shines: the square of the energy norm of the error
// of B, up to a constant.
double energy_error(const Grid& grid, int degree, double rho, double certified) {
  const GalerkinSystem system = grid.system.at_degree(degree);
  BandMatrix exitance = BandMatrix::Zero(6, 1), b;
  exitance(1, 0) = 1.0;
  system.solve(BandMatrix::Constant(6, 1, rho), system.project_constants(exitance), b);
  return std::sqrt(std::abs(system.surface_means(b)(1, 0) - certified));
}

double certified_ceiling(const std::string& rho) {
  const TableFile table =
      read_table(std::string(TRUEBOX_REFERENCE_DIR) + "/analytic/ceiling_lit_cube.csv");
  for (std::size_t row = 0; row < table.rows.size(); ++row)
    if (table.rows[row][0] == "cube_ceiling_light" && table.rows[row][2] == "mean B ceiling" &&
        table.rows[row][1].find("rho=" + rho + " ") != std::string::npos)
      return table.number(row, table.column_index("value"));
  ADD_FAILURE() << "no row " << rho;
  return 0.0;
}

TEST(BasisConvergence, IsOfTheOrderOfEachBasisAndEachMesh) {
  constexpr int kTop = 4;
  constexpr double kRho = 0.8;
  const Grid two(2, 1.0, kTop), four(4, 1.0, kTop), eight(8, 1.0, 1);
  const Grid graded_two(2, 3.0, kTop), graded_four(4, 3.0, kTop);

  std::printf("smooth B, root mean square error, N x N elements a face\n");
  const auto print = [](const char* name, double a, double b) {
    std::printf("%-24s%12.3g%12.3g%8.2f\n", name, a, b, order(a, b));
  };
  const char* const names[] = {"constant", "linear", "quadratic", "cubic"};
  for (int degree = 0; degree < kTop; ++degree) {
    const double coarse = recover(two, degree, kRho).error;
    const double fine = recover(four, degree, kRho).error;
    print(names[degree], coarse, fine);
    // p + 1, less what two coarse meshes are short of the limit.
    EXPECT_GE(order(coarse, fine), degree + 0.8) << names[degree];
    EXPECT_LE(order(coarse, fine), degree + 1.5) << names[degree];
  }
  const Recovered at_four = recover(four, 0, kRho), at_eight = recover(eight, 0, kRho);
  for (const VertexRule rule : {VertexRule::averaged, VertexRule::least_squares}) {
    const double coarse = vertex_error(four, at_four, rule);
    const double fine = vertex_error(eight, at_eight, rule);
    print(rule == VertexRule::averaged ? "vertices, averaged" : "vertices, least squares", coarse,
          fine);
    // 2 from exact means; those of the constants are less exact along the edges.
    EXPECT_GE(order(coarse, fine), 1.5);
    EXPECT_LE(order(coarse, fine), 2.2);
    EXPECT_LT(fine, 0.3 * at_eight.error) << "better than the constants they come from";
  }

  std::printf("cube lit by its ceiling, energy norm, N = 2, 4; uniform, then graded t^3\n");
  for (const char* const rho : {"0.5", "0.8"}) {
    const double certified = certified_ceiling(rho), r = std::stod(rho);
    for (int degree = 0; degree <= kTop; ++degree) {
      const double uniform[] = {energy_error(two, degree, r, certified),
                                energy_error(four, degree, r, certified)};
      const double graded[] = {energy_error(graded_two, degree, r, certified),
                               energy_error(graded_four, degree, r, certified)};
      std::printf("rho %s degree %d%12.3g%12.3g%8.2f%12.3g%12.3g%8.2f\n", rho, degree, uniform[0],
                  uniform[1], order(uniform[0], uniform[1]), graded[0], graded[1],
                  order(graded[0], graded[1]));
      // In the tips of the corners B depends on the direction: an error that does not shrink on
      // an area h^2, first order at any degree. Graded elements take that away.
      if (degree == 0) {
        EXPECT_NEAR(order(uniform[0], uniform[1]), 0.8, 0.2);
        continue;
      }
      EXPECT_NEAR(order(uniform[0], uniform[1]), 1.0, 0.15) << rho << " " << degree;
      const double least[] = {0.0, 0.75, 1.5, 2.0, 2.4};
      EXPECT_GE(order(graded[0], graded[1]), least[degree]) << rho << " " << degree;
      if (degree > 1) {
        EXPECT_LT(graded[1], 0.7 * uniform[1]);
      }
    }
  }
}

}  // namespace
}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "provenance/provenance.h"
#include "radiometry/table_file.h"
#include "transport/solve_radiosity.h"
#include "verification/accuracy_check.h"
#include "verification/box_scene.h"
#include "verification/table_parameter.h"

namespace truebox {
namespace {

FormFactors exact_factors(const PatchMesh& mesh, const Scene& scene) {
  FormFactorOptions options;
  options.relative_tolerance = 1e-13;
  options.occlusion = false;
  return form_factors(mesh, scene, Visibility(mesh, scene), options);
}

SolveOptions tight(SolveMethod method, double rho) {
  SolveOptions options;
  options.method = method;
  // The bound is residual / (1 - rho): rounding of the residual limits what can be asked for.
  options.relative_bound = std::max(1e-13, 3e-15 / (1.0 - rho));
  options.iteration_limit = 20000000;
  return options;
}

}  // namespace

std::vector<AccuracyCheck> check_furnace(const std::filesystem::path& reference_dir) {
  const TableFile table = read_table(reference_dir / "analytic" / "radiosity.csv");
  require_provenance(table);
  const Scene cube = box_scene({1.0, 1.0, 1.0});
  const PatchMesh mesh = uniform_mesh(cube, 0.25);
  const FormFactors factors = exact_factors(mesh, cube);
  const auto n = static_cast<Eigen::Index>(mesh.size());
  std::vector<AccuracyCheck> checks;
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    if (table.rows[row][0] != "furnace_any_closed") continue;
    const double rho = table_parameter(table, row, "rho");
    for (const auto& [method, name] : {std::pair{SolveMethod::conjugate_gradient, "Krylov"},
                                       std::pair{SolveMethod::gauss_seidel, "Gauss-Seidel"}}) {
      if (method == SolveMethod::gauss_seidel && rho > 0.9999) continue;  // 1e7 sweeps
      BandMatrix b;
      const auto summary = solve_radiosity(factors, BandMatrix::Constant(n, 1, rho),
                                           BandMatrix::Ones(n, 1), tight(method, rho), b);
      AccuracyCheck check{"furnace", "rho = " + std::to_string(rho) + ", " + name,
                          0.0,       1.0 / (1.0 - rho),
                          0.0,       "W m^-2 nm^-1",
                          {}};
      check.computed = b(0, 0);
      for (Eigen::Index i = 0; i < n; ++i)
        if (std::abs(b(i, 0) - check.certified) > std::abs(check.computed - check.certified))
          check.computed = b(i, 0);
      const double closure = std::abs(factors.summary.row_sum_max - 1.0);
      check.allowed = summary.error_bound[0] + (closure + 1e-14) * rho / ((1 - rho) * (1 - rho));
      check.reason = "worst element; solver bound + closure error / (1 - rho)^2";
      checks.push_back(std::move(check));
    }
  }
  return checks;
}

std::vector<AccuracyCheck> check_infinite_plates(const std::filesystem::path& reference_dir) {
  const TableFile table = read_table(reference_dir / "analytic" / "radiosity.csv");
  const std::size_t value = table.column_index("value");
  constexpr double kGap = 1e-8;  // of the plates' edge: what a pair loses at its sides
  const Scene plates = plates_scene(1.0, kGap);
  const PatchMesh mesh = uniform_mesh(plates, 1.0);
  const FormFactors factors = exact_factors(mesh, plates);
  std::vector<AccuracyCheck> checks;
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    if (table.rows[row][0] != "infinite_plates") continue;
    BandMatrix rho(2, 1), source(2, 1), b;
    rho << table_parameter(table, row, "rho1"), table_parameter(table, row, "rho2");
    source << table_parameter(table, row, "E1"), table_parameter(table, row, "E2");
    solve_radiosity(factors, rho, source, tight(SolveMethod::conjugate_gradient, rho.maxCoeff()),
                    b);
    AccuracyCheck check{"plates", table.rows[row][1] + ", " + table.rows[row][2],
                        0.0,      table.number(row, value),
                        0.0,      "W m^-2 nm^-1",
                        {}};
    check.computed = b(table.rows[row][2] == "B1" ? 0 : 1, 0);
    // Plates of edge 1 at gap g lose about 2 g of their view; the loss is amplified by 1/(1 - rho).
    check.allowed = 4.0 * kGap / (1.0 - rho.maxCoeff()) * std::abs(b.maxCoeff());
    check.reason = "finite plates, gap 1e-8 of their edge, lose 2e-8 of their view";
    checks.push_back(std::move(check));
  }
  return checks;
}

std::vector<AccuracyCheck> check_ceiling_lit_cube(const std::filesystem::path& reference_dir) {
  const TableFile table = read_table(reference_dir / "analytic" / "ceiling_lit_cube.csv");
  require_provenance(table);
  const std::size_t value = table.column_index("value");
  const Scene cube = box_scene({1.0, 1.0, 1.0});
  std::vector<AccuracyCheck> checks;
  for (const int cells : {8, 16}) {
    const PatchMesh mesh = uniform_mesh(cube, 1.0 / cells);
    const FormFactors factors = exact_factors(mesh, cube);
    const auto n = static_cast<Eigen::Index>(mesh.size());
    for (std::size_t row = 0; row < table.rows.size(); ++row) {
      const std::string mark = "N=" + std::to_string(cells) + "x";
      if (table.rows[row][0] != "cube_ceiling_light_discrete" ||
          table.rows[row][1].find(mark) == std::string::npos)
        continue;
      const double rho = table_parameter(table, row, "rho");
      BandMatrix source = BandMatrix::Zero(n, 1), b;
      for (Eigen::Index i = 0; i < n; ++i)
        if (mesh.surface_of(mesh.patches[i]) == kBoxCeiling) source(i, 0) = 1.0;
      solve_radiosity(factors, BandMatrix::Constant(n, 1, rho), source,
                      tight(SolveMethod::conjugate_gradient, rho), b);
      const std::string& quantity = table.rows[row][2];
      const std::size_t face = quantity == "mean B ceiling" ? kBoxCeiling
                               : quantity == "mean B floor" ? kBoxFloor
                                                            : kBoxWall;
      double sum = 0.0, area = 0.0;
      for (Eigen::Index i = 0; i < n; ++i) {
        if (mesh.surface_of(mesh.patches[i]) != face) continue;
        sum += b(i, 0) * mesh.patches[i].area_m2;
        area += mesh.patches[i].area_m2;
      }
      AccuracyCheck check{"cube",     table.rows[row][1] + ", " + quantity,
                          sum / area, table.number(row, value),
                          0.0,        "W m^-2 nm^-1",
                          {}};
      check.allowed = 1e-10 * check.certified;
      check.reason = "same discrete equations, 11 digits certified";
      checks.push_back(std::move(check));
    }
  }
  return checks;
}

}  // namespace truebox

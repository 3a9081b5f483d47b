// SPDX-License-Identifier: BSD-3-Clause
#include "verification/basis_checks.h"

#include <cmath>
#include <map>
#include <numbers>
#include <optional>

#include "mesh/graded_mesh.h"
#include "provenance/provenance.h"
#include "radiometry/input_error.h"
#include "radiometry/table_file.h"
#include "transport/galerkin.h"
#include "transport/strip_galerkin.h"
#include "verification/box_scene.h"
#include "verification/table_parameter.h"

namespace truebox {
namespace {

// Two facing strips of width 1, lit sides inwards.
StripEnclosure parallel_strips(double gap) {
  return StripEnclosure({{{0.0, 0.0}, {1.0, 0.0}}, {{1.0, gap}, {0.0, gap}}}, {});
}

// Two plates of length 1 that meet in the origin.
StripEnclosure wedge(double angle_deg) {
  const double angle = angle_deg * std::numbers::pi / 180.0;
  StripOptions options;
  options.degree = 9;
  options.closeness = 2.1;  // one element an octave at 30 degrees
  return StripEnclosure(
      {{{0.0, 0.0}, {1.0, 0.0}}, {{std::cos(angle), std::sin(angle)}, {0.0, 0.0}}}, options);
}

// Where along the first strip a row of the table looks; none for the mean.
std::optional<double> fraction_of(const TableFile& table, std::size_t row) {
  static const std::map<std::string, std::optional<double>> kPlaces = {
      {"B(centre)", 0.5},      {"B(edge)", 0.0},   {"B(0) vertex", 0.0},
      {"B(1) free edge", 1.0}, {"B(0.001)", 1e-3}, {"B(mean)", std::nullopt}};
  const auto found = kPlaces.find(table.rows[row][2]);
  if (found == kPlaces.end())
    throw InputError(table.path, table.row_lines[row], "B(centre), B(edge), B(mean), ...",
                     table.rows[row][2]);
  return found->second;
}

}  // namespace

std::vector<AccuracyCheck> check_strips(const std::filesystem::path& reference_dir) {
  const TableFile table = read_table(reference_dir / "analytic" / "radiosity.csv");
  require_provenance(table);
  const std::size_t value = table.column_index("value");
  std::map<std::pair<std::string, double>, StripEnclosure> enclosures;
  std::map<std::pair<const StripEnclosure*, double>, StripSolution> solutions;
  std::vector<AccuracyCheck> checks;
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    const std::string& name = table.rows[row][0];
    const bool is_wedge = name == "wedge_2D_adjoint_plates";
    if (!is_wedge && name != "parallel_strips_2D") continue;
    const double shape = table_parameter(table, row, is_wedge ? "angle" : "gap/width");
    const double rho = table_parameter(table, row, "rho");
    auto enclosure = enclosures.find({name, shape});
    if (enclosure == enclosures.end())
      enclosure =
          enclosures
              .emplace(std::pair{name, shape}, is_wedge ? wedge(shape) : parallel_strips(shape))
              .first;
    auto solution = solutions.find({&enclosure->second, rho});
    if (solution == solutions.end())
      solution = solutions
                     .emplace(std::pair{&enclosure->second, rho},
                              enclosure->second.solve({rho, rho}, {1.0, 1.0}))
                     .first;
    const std::optional<double> at = fraction_of(table, row);
    const StripSolution& b = solution->second;
    AccuracyCheck check{"bases",
                        name + ", " + table.rows[row][1] + ", " + table.rows[row][2],
                        at ? b.radiosity(0, *at) : b.mean_radiosity(0),
                        table.number(row, value),
                        0.0,
                        "W m^-2 nm^-1",
                        "own bound, and 14 digits certified"};
    constexpr double kCertified = 5e-14;
    check.allowed =
        (at ? b.error_bound(0, *at) : b.mean_error_bound(0)) + kCertified * check.certified;
    checks.push_back(std::move(check));
  }
  return checks;
}

std::vector<AccuracyCheck> check_cube_continuum(const std::filesystem::path& reference_dir) {
  const TableFile table = read_table(reference_dir / "analytic" / "ceiling_lit_cube.csv");
  require_provenance(table);
  const std::size_t value = table.column_index("value");
  const Scene cube = box_scene({1.0, 1.0, 1.0});
  GalerkinOptions options;
  options.degree = 4;
  options.relative_tolerance = 1e-7;
  const GalerkinSystem system(graded_mesh(cube, 0.25, 3.0), cube, options);
  const auto surfaces = static_cast<Eigen::Index>(system.surfaces());
  const std::vector<double> rhos = {0.5, 0.8};
  BandMatrix rho(surfaces, 2), exitance = BandMatrix::Zero(surfaces, 2), b;
  for (Eigen::Index band = 0; band < 2; ++band)
    rho.col(band).setConstant(rhos[static_cast<std::size_t>(band)]);
  exitance.row(kBoxCeiling).setOnes();
  system.solve(rho, system.project_constants(exitance), b);
  const BandMatrix means = system.surface_means(b);
  const BandMatrix bounds = system.mean_error_bound(rho, exitance, b);
  std::vector<AccuracyCheck> checks;
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    if (table.rows[row][0] != "cube_ceiling_light") continue;
    const Eigen::Index band = table_parameter(table, row, "rho") == rhos[0] ? 0 : 1;
    const std::string& quantity = table.rows[row][2];
    const std::map<std::string, Eigen::Index> faces = {
        {"mean B ceiling", kBoxCeiling}, {"mean B floor", kBoxFloor}, {"mean B wall", kBoxWall}};
    const auto face = faces.find(quantity);
    const bool one_face = face != faces.end();
    AccuracyCheck check{"bases",
                        "cube, continuum, " + table.rows[row][1] + ", " + quantity,
                        one_face ? means(face->second, band) : means.col(band).mean(),
                        table.number(row, value),
                        0.0,
                        "W m^-2 nm^-1",
                        "own bound, and two fits of the certified value differ by 2e-7"};
    check.allowed =
        (one_face ? bounds(face->second, band) : bounds.col(band).mean()) + 2e-7 * check.certified;
    checks.push_back(std::move(check));
  }
  return checks;
}

std::vector<AccuracyCheck> check_bases(const std::filesystem::path& reference_dir) {
  std::vector<AccuracyCheck> checks = check_strips(reference_dir);
  const std::vector<AccuracyCheck> cube = check_cube_continuum(reference_dir);
  checks.insert(checks.end(), cube.begin(), cube.end());
  return checks;
}

}  // namespace truebox

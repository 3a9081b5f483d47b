// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "commands.h"
#include "image/image_file.h"
#include "prediction_options.h"
#include "radiometry/input_error.h"
#include "radiometry/table_file.h"

namespace truebox::app {
namespace {

struct ProbeArguments {
  PredictionArguments prediction;
  std::string points, output;
};

struct ProbePoint {
  std::string name;
  Vec3 position_m, normal;
};

std::vector<ProbePoint> read_points(const std::string& path, double metres_per_unit) {
  const TableFile table = read_table(path);
  std::size_t column[6];
  const char* const names[] = {"x", "y", "z", "nx", "ny", "nz"};
  for (int k = 0; k < 6; ++k) column[k] = table.column_index(names[k]);
  const std::size_t name = table.column_index("name");
  std::vector<ProbePoint> points;
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    ProbePoint point{table.rows[row][name], {}, {}};
    for (int k = 0; k < 3; ++k) {
      point.position_m[k] = metres_per_unit * table.number(row, column[k]);
      point.normal[k] = table.number(row, column[3 + k]);
    }
    if (point.normal.norm() < 1e-12)
      throw InputError(path, table.row_lines[row], "a normal with a length", "nx = ny = nz = 0");
    point.normal.normalize();
    points.push_back(std::move(point));
  }
  return points;
}

int probe(const ProbeArguments& a) {
  // Points are read first: a mistake there should not cost a solve. Their unit is the scene's.
  read_points(a.points, 1.0);
  const auto predicted = predict(a.prediction);
  if (predicted->prediction->outcome() != SolveOutcome::converged) {
    fmt::print(stderr, "truebox: the solver did not reach its bound\n");
    return kNotSolved;
  }
  const auto points = read_points(a.points, predicted->scene.metres_per_unit);
  std::vector<BoundedIrradiance> answers(points.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points.size(), 1), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i)
      answers[i] = predicted->prediction->irradiance_at(points[i].position_m, points[i].normal);
  });
  const WavelengthGrid& bands = predicted->scene.bands;
  std::string text = "name,band_nm,irradiance,error_bound\n";
  double largest = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t b = 0; b < bands.size(); ++b) {
      const auto k = static_cast<Eigen::Index>(b);
      const double value = answers[i].value[k], bound = answers[i].error_bound[k];
      text += fmt::format("\"{}\",{},{:.9g},{:.3g}\n", points[i].name, bands.centre_nm(b), value,
                          bound);
      if (value > 0.0) largest = std::max(largest, bound / value);
    }
  if (a.output.empty()) {
    fmt::print("{}", text);
    return kAgrees;
  }
  write_file_atomically(a.output,
                        "# quantity: irradiance\n# unit: W m^-2 nm^-1\n# source: truebox, " +
                            predicted->scene.path + "\n" + text);
  fmt::print("{}{} points, {} bands; largest bound {:.2f} % of its irradiance\n",
             describe(*predicted), points.size(), bands.size(), 100.0 * largest);
  return kAgrees;
}

}  // namespace

void add_probe_command(CLI::App& program, Action& chosen) {
  auto* command = program.add_subcommand("probe", "irradiance at points, with an error bound");
  auto arguments = std::make_shared<ProbeArguments>();
  add_prediction_options(*command, arguments->prediction);
  command->add_option("--points", arguments->points, "CSV: name,x,y,z,nx,ny,nz in the scene's unit")
      ->required();
  command->add_option("-o,--output", arguments->output, "CSV: name,band_nm,irradiance,error_bound");
  command->footer(
      "Example: truebox probe reference/cornell_box/cornell_box.toml\n"
      "           --points reference/independent_renders/probe_points.csv -o irradiance.csv");
  command->callback([=, &chosen] { chosen = [=] { return probe(*arguments); }; });
}

}  // namespace truebox::app

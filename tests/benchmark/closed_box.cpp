// SPDX-License-Identifier: BSD-3-Clause
#include <tbb/global_control.h>
#include <time.h>

#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <memory>

#include "benchmark.h"
#include "hierarchy/hierarchical_exchange.h"
#include "radiometry/table_file.h"
#include "scene/scene_file.h"
#include "transport/prediction.h"

namespace truebox::benchmark {
namespace {

// A parallelogram of a wall and what was path-traced there, one value a band.
struct Cell {
  std::string name;
  Vec3 origin, u, v;
  std::vector<double> irradiance, standard_error;
};

std::vector<Cell> read_cells(const std::filesystem::path& path, const Scene& scene) {
  const TableFile table = read_table(path);
  std::vector<Cell> cells;
  std::map<std::string, std::size_t> index;
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    const auto [at, is_new] = index.try_emplace(table.rows[row][0], cells.size());
    if (is_new) {
      const auto vector = [&](std::size_t first) -> Vec3 {
        return scene.metres_per_unit * Vec3(table.number(row, first), table.number(row, first + 1),
                                            table.number(row, first + 2));
      };
      cells.push_back({table.rows[row][0], vector(1), vector(4), vector(7), {}, {}});
    }
    cells[at->second].irradiance.push_back(table.number(row, 11));
    cells[at->second].standard_error.push_back(table.number(row, 12));
  }
  return cells;
}

double cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace

ClosedBox measure_closed_box(const std::filesystem::path& reference_dir, std::size_t elements,
                             int threads, FormFactorMethod method, double link_tolerance) {
  const auto folder = reference_dir / "independent_renders";
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                  static_cast<std::size_t>(threads));
  ClosedBox result;
  result.threads = threads;
  result.method = method;
  Scene scene;
  std::unique_ptr<Prediction> prediction;
  const double cpu_before_s = cpu_s();
  const double read_s = seconds([&] { scene = read_scene(folder / "closed_box.toml"); });
  const std::vector<Cell> cells = read_cells(folder / "closed_box_cell_irradiance.csv", scene);
  PredictOptions options;
  options.elements = elements;
  options.form_factors.method = method;
  if (link_tolerance > 0.0) {
    HierarchyOptions hierarchy;
    hierarchy.relative_tolerance = link_tolerance;
    options.find_exchange = hierarchical_exchange(hierarchy);
  }
  const double solve_s =
      seconds([&] { prediction = std::make_unique<Prediction>(scene, options); });
  const auto bands = static_cast<Eigen::Index>(scene.bands.size());
  std::vector<Eigen::VectorXd> mean(cells.size()), bound(cells.size());
  const double cells_s = seconds([&] {
    for (std::size_t c = 0; c < cells.size(); ++c) {
      const auto& [name, o, u, v, expected, standard_error] = cells[c];
      Polygon area = {o, o + u, o + u + v, o + v};
      auto found = prediction->mean_irradiance_over(area);
      if (!found)  // the table does not say which side is lit
        found = prediction->mean_irradiance_over(Polygon(area.rbegin(), area.rend()));
      mean[c] = found->value;
      bound[c] = found->error_bound;
    }
  });
  result.elements = prediction->fine().mesh.size();
  if (const auto& links = prediction->fine().links) result.links = links->links;
  result.link_tolerance = link_tolerance;
  result.job_s = read_s + solve_s + cells_s;
  result.job_cpu_s = cpu_s() - cpu_before_s;
  result.cells_s = cells_s;
  double count = 0.0;
  for (std::size_t c = 0; c < cells.size(); ++c)
    for (Eigen::Index b = 0; b < bands; ++b) {
      const double expected = cells[c].irradiance[static_cast<std::size_t>(b)];
      if (expected <= 0.0) continue;
      const double error = std::abs(mean[c][b] - expected);
      const double standard_error = cells[c].standard_error[static_cast<std::size_t>(b)];
      result.rms_error += std::pow(error / expected, 2);
      result.rms_standard_error += std::pow(standard_error / expected, 2);
      result.mean_bound += bound[c][b] / expected;
      result.covered += error <= bound[c][b] + 3.0 * standard_error ? 1.0 : 0.0;
      count += 1.0;
    }
  result.rms_error = std::sqrt(result.rms_error / count);
  result.rms_standard_error = std::sqrt(result.rms_standard_error / count);
  result.mean_bound /= count;
  result.covered /= count;
  return result;
}

}  // namespace truebox::benchmark

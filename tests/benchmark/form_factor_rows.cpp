// SPDX-License-Identifier: BSD-3-Clause
#include <sys/resource.h>
#include <tbb/global_control.h>
#include <time.h>

#include <cmath>

#include "benchmark.h"
#include "scene/scene_file.h"
#include "support/brute_force_rows.h"
#include "transport/enclosure.h"
#include "transport/exact_form_factors.h"

namespace truebox::benchmark {
namespace {

double cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

std::size_t resident_bytes_at_most() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::size_t>(usage.ru_maxrss) * 1024;
}

}  // namespace

FormFactorRows measure_form_factor_rows(const std::filesystem::path& reference_dir,
                                        std::size_t elements, int threads, int points,
                                        double tolerance, int rows_compared) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                  static_cast<std::size_t>(threads));
  const Scene scene = read_scene(reference_dir / "independent_renders" / "closed_box.toml");
  const PatchMesh mesh = uniform_mesh(scene, edge_for_count(scene, elements));
  ExactFormFactorOptions options;
  options.outline_points = points;
  (points > 0 ? options.outline_tolerance : options.relative_tolerance) = tolerance;
  if (points > 0) options.relative_tolerance = 1e-3;
  FormFactorRows result;
  result.threads = threads;
  result.points = points;
  result.tolerance = tolerance;
  result.elements = mesh.size();
  result.cpu_s = result.wall_s = std::numeric_limits<double>::infinity();
  ExactFormFactors<double> factors;
  const int repetitions = points == 0 ? 1 : mesh.size() < 1500 ? 15 : 3;
  for (int repetition = 0; repetition < repetitions; ++repetition) {
    factors = {};
    const std::size_t before = resident_bytes_at_most();
    const double start_s = cpu_s();
    result.wall_s =
        std::min(result.wall_s,
                 seconds([&] { factors = exact_form_factors<double>(mesh, scene, options); }));
    result.cpu_s = std::min(result.cpu_s, cpu_s() - start_s);
    if (repetition == 0) result.memory_bytes = resident_bytes_at_most() - before;
  }
  const double n = static_cast<double>(mesh.size());
  result.pairs = 0.5 * n * (n - 1.0);
  double weighted = 0.0, area_m2 = 0.0;
  for (Eigen::Index i = 0; i < factors.area_m2.size(); ++i) {
    const double sum = factors.exchange_area_m2.col(i).sum() / factors.area_m2[i];
    result.buried_rows += sum < kEmptyRow;
    if (sum < kEmptyRow) continue;
    weighted += factors.area_m2[i] * (sum - 1.0) * (sum - 1.0);
    area_m2 += factors.area_m2[i];
    result.row_sum_max_error = std::max(result.row_sum_max_error, std::abs(sum - 1.0));
  }
  result.row_sum_rms_error = std::sqrt(weighted / area_m2);
  const std::vector<PlanarPolygon> patches = planar_polygons(mesh);
  for (int k = 0; k < rows_compared; ++k) {
    auto i = static_cast<std::uint32_t>((k + 0.5) * n / rows_compared);
    while (factors.exchange_area_m2.col(i).sum() < 0.5 * factors.area_m2[i]) ++i;
    result.row_difference =
        std::max(result.row_difference, row_difference(mesh, patches, factors.exchange_area_m2, i));
  }
  return result;
}

}  // namespace truebox::benchmark

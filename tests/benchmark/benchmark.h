// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <ctime>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "scene/scene.h"
#include "transport/form_factors.h"

namespace truebox::benchmark {

/// Wall-clock time of one call, s.
template <class Work>
double seconds(const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// The shortest of a few calls, s: what the machine can do when nothing disturbs it.
template <class Work>
double best_seconds(const Work& work, int repetitions = 5) {
  double best = std::numeric_limits<double>::infinity();
  for (int i = 0; i < repetitions; ++i) best = std::min(best, seconds(work));
  return best;
}

/// Processor time of one call, all threads, s: what a busy machine does not change.
template <class Work>
double processor_seconds(const Work& work) {
  const auto now = [] { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; };
  const double start = now();
  work();
  return now() - start;
}

/// A prediction of the Cornell Box against independent path tracing, relative to the irradiance,
/// over all points and bands that receive light.
struct Accuracy {
  std::size_t elements = 0, coarse_elements = 0, compared = 0;
  double solve_s = 0.0;
  double probe_s = 0.0;  ///< all points, one thread
  double rms_error = 0.0;
  double max_error = 0.0;
  double rms_standard_error = 0.0;  ///< of the path tracer: what rms_error cannot fall below
  double mean_bound = 0.0;          ///< as the program states it
  double covered = 0.0;             ///< share of errors within bound + 2 standard errors
};
Accuracy measure_accuracy(const Scene& scene, const std::filesystem::path& reference_dir,
                          std::size_t elements);

/// The whole job on the closed box, scene file to the mean irradiance of its wall cells in 31
/// bands, against independent path tracing.
struct ClosedBox {
  std::size_t elements = 0;
  FormFactorMethod method = FormFactorMethod::ray_casting;
  double link_tolerance = 0.0;  ///< of hierarchical form factors; 0: the full matrix
  std::size_t links = 0;        ///< of the fine grid
  int threads = 1;
  double job_s = 0.0;
  double job_cpu_s = 0.0;  ///< processor time, all threads: what a busy machine does not change
  double cells_s = 0.0;    ///< of these, the means of the cells
  double rms_error = 0.0;
  double rms_standard_error = 0.0;  ///< of the path tracer
  double mean_bound = 0.0;
  double covered = 0.0;  ///< share of errors within bound + 3 standard errors
};
ClosedBox measure_closed_box(const std::filesystem::path& reference_dir, std::size_t elements,
                             int threads, FormFactorMethod method, double link_tolerance = 0.0);

/// Form factors of all pairs of the closed box, without rays, before any repair: rows must sum
/// to 1.
struct FormFactorRows {
  std::size_t elements = 0;
  int threads = 1;
  int points = 0;          ///< of partly hidden pairs, along one direction; 0: adaptive
  double tolerance = 0.0;  ///< for more points, or of adaptive visibility
  double cpu_s = 0.0, wall_s = 0.0;
  double pairs = 0.0;
  double row_sum_rms_error = 0.0;  ///< area-weighted
  double row_sum_max_error = 0.0;
  std::size_t buried_rows = 0;  ///< patches under a block, which see nothing; all others count
  /// Largest sum over a row of |F_ij - brute force|, some rows; brute force is good to some 1e-3.
  double row_difference = 0.0;
  std::size_t memory_bytes = 0;  ///< by which the largest resident set grew
};
FormFactorRows measure_form_factor_rows(const std::filesystem::path& reference_dir,
                                        std::size_t elements, int threads, int points,
                                        double tolerance, int rows_compared);

/// All bands beside one, with so many threads. Shortest of many times.
struct BandKernels {
  int threads = 0;
  double triad_bytes_per_s = 0.0;             ///< a = b + s c, three doubles counted
  double product_flop_per_s = 0.0;            ///< S times all bands
  double product_one_band_bytes_per_s = 0.0;  ///< S times one band: S is read once
  double bands_time_ratio = 0.0;              ///< time of all bands : time of one, a pass
  double solve_one_band_s = 0.0;
  double solve_time_ratio = 0.0;  ///< the same of a whole solve, bands shared
  double matrix_passes = 0.0;     ///< of that solve
  double one_band_passes = 0.0;   ///< of the slowest band by itself
  int bands_reduced = 0;          ///< of that solve: bands less the most products of a pass
};

/// What the machine does, and what the program makes of it.
struct Kernels {
  std::size_t elements = 0, bands = 0;
  double occlusion_queries_per_s = 0.0;  ///< rays alone, between random elements
  double rays_per_s = 0.0;               ///< rays of form factors, over the whole of their time
  double pairs_per_s = 0.0;              ///< all pairs, occlusion included
  double pairs_unoccluded_per_s = 0.0;   ///< the same scene as if nothing stood in between
  std::vector<BandKernels> of_threads;   ///< one and two
};
Kernels measure_kernels(const Scene& scene, std::size_t elements);

/// Work to a relative error bound by both methods on the same form factors.
struct SolverWork {
  double relative_bound = 0.0;
  double krylov_passes = 0.0, gauss_seidel_passes = 0.0;  ///< over the matrix, all bands at once
  double krylov_s = 0.0, gauss_seidel_s = 0.0;
};
std::vector<SolverWork> measure_solvers(const Scene& scene, std::size_t elements,
                                        const std::vector<double>& relative_bounds);

/// Relative error of the pixels of one picture, 512 x 512 in the scene's bands, against a long path
/// trace of some of its pixels; processor time of the whole picture, all threads together.
struct PictureError {
  std::string name;  ///< "radiosity", "paths"
  int setting = 0;   ///< elements, paths a pixel
  double processor_s = 0.0, solve_s = 0.0;
  double median = 0.0, p99 = 0.0;
};
struct PictureBenchmark {
  PictureError truth_noise;  ///< one standard error of the truth: a floor of all rows
  std::vector<PictureError> rows;
};
PictureBenchmark measure_pictures(const Scene& scene, const std::vector<std::size_t>& elements,
                                  const std::vector<int>& samples);

/// Links of one mesh and tolerance, and the full matrix of the same mesh: finding and solving in
/// the scene's bands, one thread.
struct LinkGrowth {
  std::string scene;
  double tolerance = 0.0;
  std::size_t elements = 0, links = 0;
  std::size_t links_bytes = 0, matrix_bytes = 0;
  double links_s = 0.0, matrix_s = 0.0;  ///< processor time; matrix 0: not asked for
  double estimate = 0.0;  ///< of what links leave out, rms relative to the mean irradiance
  double error = 0.0;     ///< the same against the matrix
};
LinkGrowth measure_links(const std::string& name, const Scene& scene, std::size_t elements,
                         double tolerance, bool with_matrix);
/// The caveat (Garmann 1995): two fixed patches and a tolerance of 0 link every pair.
LinkGrowth measure_facing_squares(std::size_t elements);
Scene museum_of(std::size_t patches);
/// Links against elements, a curve a scene and tolerance in the order of the rows.
std::string links_svg(const std::vector<LinkGrowth>& rows);

}  // namespace truebox::benchmark

// SPDX-License-Identifier: BSD-3-Clause
#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <random>

#include "benchmark.h"
#include "transport/band_product.h"
#include "transport/form_factors.h"
#include "transport/solve_radiosity.h"

namespace truebox::benchmark {
namespace {

double triad_bytes_per_s() {
  constexpr std::size_t kCount = std::size_t{1} << 24;  // 128 MiB an array: far beyond any cache
  std::vector<double> a(kCount, 0.0), b(kCount, 1.0), c(kCount, 2.0);
  const double time = best_seconds([&] {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, kCount, 1 << 16), [&](const auto& range) {
      for (std::size_t i = range.begin(); i < range.end(); ++i) a[i] = b[i] + 3.0 * c[i];
    });
  });
  return 3.0 * sizeof(double) * kCount / time;
}

double occlusion_queries_per_s(const PatchMesh& mesh, const Visibility& visibility) {
  constexpr std::size_t kRays = 4'000'000;
  std::mt19937 random(1);
  std::uniform_int_distribution<std::uint32_t> pick(0, static_cast<std::uint32_t>(mesh.size() - 1));
  std::vector<std::pair<std::uint32_t, std::uint32_t>> ends(kRays);
  for (auto& [from, to] : ends) from = pick(random), to = pick(random);
  std::atomic<std::size_t> hidden{0};
  const double time = best_seconds(
      [&] {
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, kRays, 4096), [&](const auto& range) {
          std::size_t count = 0;
          for (std::size_t i = range.begin(); i < range.end(); ++i) {
            const Patch& from = mesh.patches[ends[i].first];
            const Patch& to = mesh.patches[ends[i].second];
            count += visibility.occluded(from.centroid, mesh.plane_of(from).normal, to.centroid,
                                         mesh.plane_of(to).normal);
          }
          hidden += count;
        });
      },
      3);
  return kRays / time;
}

// What the rays of a pair cost beside Embree's own rate.
FormFactorOptions by_rays() {
  FormFactorOptions options;
  options.method = FormFactorMethod::ray_casting;
  return options;
}

struct BoxProblem {
  PatchMesh mesh;
  FormFactors factors;
  BandMatrix rho, source;

  BoxProblem(const Scene& scene, std::size_t elements)
      : mesh(uniform_mesh(scene, edge_for_count(scene, elements))),
        factors(form_factors(mesh, scene, Visibility(mesh, scene), by_rays())) {
    const auto bands = static_cast<Eigen::Index>(scene.bands.size());
    rho.resize(factors.size(), bands);
    source.resize(factors.size(), bands);
    for (Eigen::Index i = 0; i < rho.rows(); ++i) {
      const Material& material = scene.material_of(
          scene.surfaces[mesh.surface_of(mesh.patches[static_cast<std::size_t>(i)])]);
      rho.row(i) = Eigen::Map<const Eigen::RowVectorXd>(material.reflectance.values.data(), bands);
      source.row(i) = Eigen::Map<const Eigen::RowVectorXd>(material.exitance.values.data(), bands);
    }
  }
};

BandKernels measure_bands(const BoxProblem& box, int threads) {
  constexpr int kRepetitions = 25;
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                  static_cast<std::size_t>(threads));
  const auto n = static_cast<double>(box.mesh.size());
  const Eigen::MatrixXd& s = box.factors.exchange_area_m2;
  BandKernels result;
  result.threads = threads;
  result.triad_bytes_per_s = triad_bytes_per_s();
  const BandMatrix one = box.source.rightCols(1), one_rho = box.rho.rightCols(1);
  double sum = 0.0;
  const double all_s =
      best_seconds([&] { sum += band_product(s, box.source)(0, 0); }, kRepetitions);
  const double one_s = best_seconds([&] { sum += band_product(s, one)(0, 0); }, kRepetitions);
  BandMatrix radiosity;
  const double solve_all_s = best_seconds(
      [&] {
        const auto summary = solve_radiosity(box.factors, box.rho, box.source, {}, radiosity);
        result.bands_reduced = summary.bands_reduced;
        result.matrix_passes = summary.matrix_passes;
      },
      kRepetitions);
  result.solve_one_band_s = best_seconds(
      [&] {
        result.one_band_passes =
            solve_radiosity(box.factors, one_rho, one, {}, radiosity).matrix_passes;
      },
      kRepetitions);
  result.solve_time_ratio = solve_all_s / result.solve_one_band_s;
  if (!(sum >= 0.0)) return {};  // keeps the products from being optimised away
  result.product_flop_per_s = 2.0 * n * n * static_cast<double>(box.source.cols()) / all_s;
  result.product_one_band_bytes_per_s = n * n * sizeof(double) / one_s;
  result.bands_time_ratio = all_s / one_s;
  return result;
}

}  // namespace

Kernels measure_kernels(const Scene& scene, std::size_t elements) {
  const BoxProblem box(scene, elements);
  const Visibility visibility(box.mesh, scene);
  const auto n = static_cast<double>(box.mesh.size());
  Kernels result;
  result.elements = box.mesh.size();
  result.bands = scene.bands.size();
  result.occlusion_queries_per_s = occlusion_queries_per_s(box.mesh, visibility);
  FormFactorOptions options = by_rays();
  const double occluded_s =
      best_seconds([&] { form_factors(box.mesh, scene, visibility, options); }, 2);
  result.rays_per_s = static_cast<double>(box.factors.summary.rays) / occluded_s;
  result.pairs_per_s = 0.5 * n * (n - 1.0) / occluded_s;
  options.occlusion = false;
  result.pairs_unoccluded_per_s =
      0.5 * n * (n - 1.0) /
      best_seconds([&] { form_factors(box.mesh, scene, visibility, options); }, 2);
  for (const int threads : {1, 2}) result.of_threads.push_back(measure_bands(box, threads));
  return result;
}

std::vector<SolverWork> measure_solvers(const Scene& scene, std::size_t elements,
                                        const std::vector<double>& relative_bounds) {
  const BoxProblem box(scene, elements);
  std::vector<SolverWork> results;
  for (double relative_bound : relative_bounds) {
    SolverWork work;
    work.relative_bound = relative_bound;
    SolveOptions options;
    options.relative_bound = relative_bound;
    const auto solve = [&](SolveMethod method, double& passes) {
      options.method = method;
      BandMatrix radiosity;
      SolveSummary summary;
      const double time = seconds(
          [&] { summary = solve_radiosity(box.factors, box.rho, box.source, options, radiosity); });
      passes = summary.outcome == SolveOutcome::converged ? summary.matrix_passes : -1;
      return time;
    };
    work.krylov_s = solve(SolveMethod::conjugate_gradient, work.krylov_passes);
    work.gauss_seidel_s = solve(SolveMethod::gauss_seidel, work.gauss_seidel_passes);
    results.push_back(work);
  }
  return results;
}

}  // namespace truebox::benchmark

// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <ctime>

#include "prediction_options.h"
#include "radiometry/input_error.h"
#include "scene/requirements.h"
#include "sweep.h"
#include "transport/solve_radiosity.h"

namespace truebox::app {
namespace {

using Eigen::Index;

constexpr std::size_t kElements = 1200;
constexpr double kReferenceBound = 1e-13;

double process_cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

struct System {
  FormFactors factors;
  BandMatrix rho, source;
};

System system_of(const Scene& scene, const Progress& progress) {
  const PatchMesh mesh = uniform_mesh(scene, edge_for_count(scene, kElements));
  FormFactorOptions options;
  options.progress = progress;
  System system{form_factors(mesh, scene, Visibility(mesh, scene), options), {}, {}};
  const auto bands = static_cast<Index>(scene.bands.size());
  system.rho.resize(system.factors.size(), bands);
  system.source.resize(system.factors.size(), bands);
  for (Index i = 0; i < system.rho.rows(); ++i) {
    const Material& material = scene.material_of(
        scene.surfaces[mesh.surface_of(mesh.patches[static_cast<std::size_t>(i)])]);
    for (Index k = 0; k < bands; ++k) {
      system.rho(i, k) = material.reflectance[static_cast<std::size_t>(k)];
      system.source(i, k) = material.exitance[static_cast<std::size_t>(k)];
    }
  }
  return system;
}

// Largest error of an element in units of its band's largest radiosity, and the share of bands
// whose error was within the bound that the solver states.
SweepPoint measure(const System& system, const BandMatrix& truth, const SolveOptions& options,
                   const std::string& method) {
  SweepPoint point;
  BandMatrix b;
  const double start = process_cpu_s();
  const SolveSummary summary =
      solve_radiosity(system.factors, system.rho, system.source, options, b);
  point.cpu_s = process_cpu_s() - start;
  point.method = method;
  point.setting =
      fmt::format("{:.0e}, {:.4g} passes", options.relative_bound, summary.matrix_passes);
  Index held = 0;
  for (Index k = 0; k < b.cols(); ++k) {
    const double largest = truth.col(k).cwiseAbs().maxCoeff();
    const double error = (b.col(k) - truth.col(k)).cwiseAbs().maxCoeff();
    held += error <= summary.error_bound[k] + kReferenceBound * largest;
    if (largest > 0.0) point.error = std::max(point.error, error / largest);
  }
  point.error = std::max(point.error, 1e-16);  // a plot has no 0
  point.bound_held = static_cast<double>(held) / static_cast<double>(b.cols());
  return point;
}

}  // namespace

Sweep sweep_radiosity(const Scene& scene, const SweepArguments& a) {
  require_lambertian(scene);
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  const auto progress = terminal_progress(a.quiet);
  const System system = system_of(scene, progress);
  if (system.source.isZero(0.0)) throw InputError(scene.path, 0, "a surface that emits", "none");
  BandMatrix truth;
  SolveOptions exact;
  exact.relative_bound = kReferenceBound;
  exact.share_bands = false;
  solve_radiosity(system.factors, system.rho, system.source, exact, truth);
  Sweep sweep;
  sweep.title = fmt::format("radiosity of {} elements in {} bands, one thread",
                            system.factors.size(), scene.bands.size());
  sweep.error_name = "largest relative error";
  sweep.reference =
      fmt::format("conjugate gradients in every band to a bound of {:.0e}", kReferenceBound);
  const auto ladder = [&](SolveOptions options, const std::string& name) {
    for (const double bound : {1e-1, 1e-2, 1e-4, 1e-7, 1e-10}) {
      options.relative_bound = bound;
      sweep.points.push_back(measure(system, truth, options, name));
      if (progress) progress(name, -std::log10(bound) / 10.0);
      if (options.method == SolveMethod::direct || sweep.points.back().cpu_s > a.time_limit_s)
        break;  // a factorisation has one accuracy
    }
  };
  for (const std::string& name : method_names()) {
    SolveOptions options;
    options.method = method_of_name(name);
    options.share_bands = false;
    ladder(options, name);
    if (options.method != SolveMethod::conjugate_gradient) continue;
    options.share_bands = true;
    ladder(options, name + ", shared bands");
  }
  return sweep;
}

}  // namespace truebox::app

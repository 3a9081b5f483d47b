// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>

#include "prediction_options.h"
#include "radiometry/input_error.h"
#include "radiometry/processor_time.h"
#include "scene/requirements.h"
#include "sweep.h"
#include "transport/solve_radiosity.h"

namespace truebox::app {
namespace {

using Eigen::Index;

constexpr std::size_t kElements = 1200;
constexpr double kReferenceBound = 1e-13;

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
  point.setting = fmt::format("bound {:.0e}", options.relative_bound);
  point.work = fmt::format("{:.4g} passes", summary.matrix_passes);
  point.bound = options.relative_bound;
  point.matrix_passes = summary.matrix_passes;
  Index held = 0;
  for (Index k = 0; k < b.cols(); ++k) {
    const double largest = truth.col(k).cwiseAbs().maxCoeff();
    const double error = (b.col(k) - truth.col(k)).cwiseAbs().maxCoeff();
    held += error <= summary.error_bound[k] + kReferenceBound * largest;
    if (largest > 0.0) point.error = std::max(point.error, error / largest);
  }
  point.error = point.largest_error = std::max(point.error, 1e-16);  // a plot has no 0
  point.bound_held = static_cast<double>(held) / static_cast<double>(b.cols());
  return point;
}

struct Ladder {
  std::string name;
  SolveOptions options;
};

std::vector<Ladder> ladders() {
  std::vector<Ladder> all;
  for (const std::string& name : method_names()) {
    SolveOptions options;
    options.method = method_of_name(name);
    options.share_bands = false;
    all.push_back({name, options});
    if (options.method != SolveMethod::conjugate_gradient) continue;
    options.share_bands = true;
    all.push_back({name + ", shared bands", options});
  }
  return all;
}

class RadiositySweep : public SweepSubject {
 public:
  RadiositySweep(const Scene& scene, const SweepArguments& a)
      : scene_(scene), arguments_(a), ladders_(ladders()) {
    require_lambertian(scene);
  }

  std::vector<std::string> jobs() const override {
    std::vector<std::string> names;
    for (const Ladder& ladder : ladders_) names.push_back(ladder.name);
    return names;
  }

  Sweep prepare() override {
    const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
    system_ = system_of(scene_, terminal_progress(arguments_.quiet));
    if (system_.source.isZero(0.0))
      throw InputError(scene_.path, 0, "a surface that emits", "none");
    SolveOptions exact;
    exact.relative_bound = kReferenceBound;
    exact.share_bands = false;
    solve_radiosity(system_.factors, system_.rho, system_.source, exact, truth_);
    Sweep sweep;
    sweep.title = fmt::format("radiosity of {} elements in {} bands, one thread",
                              system_.factors.size(), scene_.bands.size());
    sweep.error_name = "largest relative error";
    sweep.reference =
        fmt::format("conjugate gradients in every band to a bound of {:.0e}", kReferenceBound);
    sweep.floor = kReferenceBound;
    return sweep;
  }

  std::vector<SweepPoint> run(std::size_t job) override {
    const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
    std::vector<SweepPoint> points;
    SolveOptions options = ladders_[job].options;
    for (const double bound : {1e-1, 1e-2, 1e-3, 1e-6, 1e-9, 1e-12}) {
      options.relative_bound = bound;
      points.push_back(measure(system_, truth_, options, ladders_[job].name));
      if (options.method == SolveMethod::direct || points.back().cpu_s > arguments_.time_limit_s)
        break;  // a factorisation has one accuracy
    }
    return points;
  }

 private:
  const Scene& scene_;
  const SweepArguments& arguments_;
  std::vector<Ladder> ladders_;
  System system_;
  BandMatrix truth_;
};

}  // namespace

std::unique_ptr<SweepSubject> sweep_radiosity(const Scene& scene, const SweepArguments& a) {
  return std::make_unique<RadiositySweep>(scene, a);
}

}  // namespace truebox::app

// SPDX-License-Identifier: BSD-3-Clause
#include "fit_scene.h"

#include <fmt/core.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <csignal>

#include "commands.h"
#include "document/writers.h"
#include "image/image_file.h"
#include "prediction_options.h"

namespace truebox::app {
namespace {

std::atomic<bool> interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free);  // the handler may touch nothing else

/// While it lives, the first Ctrl-C asks the fit to stop; the next one ends the program.
class StopOnInterrupt {
 public:
  StopOnInterrupt() {
    interrupted = false;
    struct sigaction action {};
    action.sa_handler = [](int) { interrupted = true; };
    action.sa_flags = static_cast<int>(SA_RESETHAND);
    sigaction(SIGINT, &action, &before_);
  }
  ~StopOnInterrupt() { sigaction(SIGINT, &before_, nullptr); }
  StopOnInterrupt(const StopOnInterrupt&) = delete;
  StopOnInterrupt& operator=(const StopOnInterrupt&) = delete;

 private:
  struct sigaction before_ {};
};

/// Progress for a person, and the way out of what is at work: it throws FitStopped.
Progress stoppable_progress() {
  return [shown = terminal_progress()](const std::string& stage, double share) {
    if (interrupted.load()) throw FitStopped{};
    if (shown) shown(stage, share);
  };
}

std::string number(const FittedParameter& p) {
  if (p.at_bound || !p.determined) return fmt::format("{:>11.5g}   no u      ", p.estimate.value);
  return fmt::format("{:>11.5g} +- {:<9.2g}", p.estimate.value, p.estimate.standard_uncertainty);
}

void print_counts(const SceneFitRun& run) {
  for (std::size_t k = 0; k < run.measurement.counts.size(); ++k) {
    const PlaneCounts& c = run.measurement.counts[k];
    fmt::print("{}: {} pixels in {} readings", c.name, c.used,
               run.measurement.problem.planes[k].readings.size());
    const std::pair<std::size_t, const char*> rest[] = {{c.held_out, "held out"},
                                                        {c.masked, "masked"},
                                                        {c.saturated, "saturated"},
                                                        {c.not_finite, "not finite"},
                                                        {c.not_shown, "at edges or not shown"}};
    for (const auto& [n, what] : rest)
      if (n > 0) fmt::print(", {} {}", n, what);
    fmt::print("\n");
  }
}

void print_fit(const SceneFitRun& run) {
  const SceneFit& fit = run.fit;
  fmt::print("{}{}\n", run.measurement.file.title,
             run.measurement.file.simulated ? " (simulated photographs)" : "");
  print_counts(run);
  fmt::print("{}\n\n", fit.summary.brief());
  for (const FittedParameter& p : fit.parameters)
    fmt::print("{:<36} {}{:<4}{}\n", p.name, number(p), p.unit == "1" ? "" : p.unit,
               p.note.empty() ? "" : "  " + p.note);
  if (fit.null_directions.size() > 1)
    for (const std::string& direction : fit.null_directions)
      fmt::print("not determined: {}\n", direction);
  if (!fit.weakest_direction.empty()) fmt::print("\nleast determined: {}\n", fit.weakest_direction);
  if (fit.birge > 1.0)
    fmt::print("chi2/nu is above what chance explains: uncertainties enlarged by {:.2f}\n",
               fit.birge);
  fmt::print("\n{:<20} {:>8} {:>8} {:>9} {:>9}\n", "surface", "readings", "mean / %", "chi2/n",
             "max |z|");
  for (const SurfaceResidual& r : surface_residuals(run))
    fmt::print("{:<20} {:>8} {:>8.2f} {:>9.2f} {:>9.2f}\n", r.surface, r.readings, r.mean_percent,
               r.chi2, r.farthest);
  if (!run.held_out.empty())
    fmt::print("held out: {} readings, rms {:.2f} %, {:.1f} % within U (k = 2)\n",
               run.held_out.size(), 100.0 * rms_relative(run.held_out),
               100.0 * share_within(run.held_out));
  if (!run.candidates.empty()) fmt::print("\n{}", describe(run.candidates));
}

}  // namespace

double share_within(const std::vector<FittedReading>& readings) {
  double n = 0.0;
  for (const FittedReading& r : readings) n += std::abs(r.z()) <= 2.0;
  return readings.empty() ? 0.0 : n / static_cast<double>(readings.size());
}

double rms_relative(const std::vector<FittedReading>& readings) {
  double sum = 0.0, value = 0.0;
  for (const FittedReading& r : readings) {
    sum += std::pow(r.value - r.predicted, 2);
    value += r.value * r.value;
  }
  return value > 0.0 ? std::sqrt(sum / value) : 0.0;
}

std::vector<SurfaceResidual> surface_residuals(const SceneFitRun& run) {
  const Scene& scene = run.measurement.scene();
  std::vector<SurfaceResidual> all(scene.surfaces.size());
  std::vector<double> predicted(all.size(), 0.0), value = predicted;
  for (const FittedReading& r : run.fit.readings) {
    const std::size_t i = run.measurement.model().blocks()[r.block].surface;
    SurfaceResidual& s = all[i];
    ++s.readings;
    value[i] += r.value;
    predicted[i] += r.predicted;
    s.chi2 += r.z() * r.z();
    s.farthest = std::max(s.farthest, std::abs(r.z()));
  }
  std::vector<SurfaceResidual> seen;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].readings == 0) continue;
    all[i].surface = scene.surfaces[i].name;
    all[i].mean_percent = 100.0 * (value[i] / predicted[i] - 1.0);
    all[i].chi2 /= static_cast<double>(all[i].readings);
    seen.push_back(all[i]);
  }
  return seen;
}

int fit_scene_measurement(const FitSceneArguments& arguments) {
  const StopOnInterrupt watch;
  const Progress progress = stoppable_progress();
  const bool terminal = isatty(STDERR_FILENO) != 0;
  SceneFitRun run;
  ShapeFitOptions options;
  options.on_step = [&](const FitStep& step) {
    if (terminal)
      fmt::print(stderr, "\r\033[Kfit: step {}, chi2 {:.6g}", step.iteration, step.chi2);
    return interrupted.load();
  };
  try {
    SceneMeasurementFile file = read_scene_measurement(arguments.measurement);
    file.consider_gloss = arguments.select;
    run.measurement = read_scene_fit(file, progress);
    run.fit = fit_measurement(run.measurement, options, progress);
    if (arguments.select && !run.fit.stopped)
      run.candidates = select_model(run.measurement.problem, run.measurement.held_out, options);
  } catch (const FitStopped&) {
    if (terminal) fmt::print(stderr, "\r\033[K");
    fmt::print(stderr, "truebox: stopped by the user before there was a fit; no file is written\n");
    return kNotSolved;
  }
  if (terminal) fmt::print(stderr, "\r\033[K");
  const bool usable = run.fit.summary.outcome != Outcome::invalid_problem;
  if (usable && !run.fit.readings.empty())
    run.held_out = predict_held_out(run.measurement.problem, run.measurement.held_out, run.fit);
  print_fit(run);
  if (!arguments.output.empty())
    write_file_atomically(arguments.output, scene_fit_json(run).dump(2) + "\n");
  if (!arguments.directory.empty() && usable) {
    write_report(arguments.directory, scene_fit_report(run));
    write_residual_maps(run, arguments.directory);
    fmt::print("report: {}\n",
               (std::filesystem::path(arguments.directory) / "report.html").string());
  }
  if (!usable) {
    fmt::print(stderr, "truebox: {}\n", run.fit.summary.message);
    return kNotSolved;
  }
  return run.fit.summary.outcome == Outcome::converged ? kAgrees : kNotSolved;
}

}  // namespace truebox::app

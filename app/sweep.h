// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "run_ledger.h"
#include "scene/scene.h"

namespace truebox::app {

/// One method at one setting: what it cost and how wrong it was.
struct SweepPoint {
  std::string method, setting;
  double cpu_s = 0.0;          ///< processor time, all threads
  double error = 0.0;          ///< against the sweep's reference
  double largest_error = 0.0;  ///< of a single answer
  double bound = 0.0;          ///< mean of what the method says it can be wrong by; 0: nothing
  double bound_held = 1.0;     ///< share of the answers whose error was within their stated bound
  bool bound_is_promised = true;        ///< false: the method itself calls its bound an estimate
  std::string work;                     ///< what was done, in counts
  std::optional<double> matrix_passes;  ///< over the form factors, of a solve
  bool on_front = false;                ///< no other point is both faster and better
};

/// Error against time for several methods on the same work.
struct Sweep {
  std::string title;       ///< what was computed
  std::string error_name;  ///< "rms relative error of 120 view factors"
  std::string reference;   ///< what the error is against, and how good that is
  double floor = 0.0;      ///< error of the reference itself: what lies below means nothing
  double resolved = 0.0;   ///< above it errors can be told apart: the floor and its own uncertainty
  std::vector<std::string> left_out;  ///< methods that were not run, with reasons
  std::vector<SweepPoint> points;
};

struct SweepArguments {
  std::string scene, of = "irradiance", json, plot, state, output;
  std::string from, to;        ///< of view factors: names of surfaces, all if empty
  double time_limit_s = 20.0;  ///< of one point; a method's finer settings are left out beyond
  std::string points, reference, camera;  ///< of irradiance: places, their values; or a camera
  std::string save_reference;
  std::size_t places = 32;               ///< of irradiance, where no points are given
  std::string reference_error = "0.3%";  ///< standard error that the reference is traced to
  std::size_t largest_elements = 4000;
  int largest_paths = 4096;
  JobShare share;
  std::string index;  ///< as typed
  bool restart = false;
  bool quiet = false;
};

/// What can be swept. Jobs are independent of one another, so that a run can stop and go on, or be
/// shared out.
class SweepSubject {
 public:
  virtual ~SweepSubject() = default;

  virtual std::vector<std::string> jobs() const = 0;
  /// Title, error and reference, found before the first job is run; no points.
  virtual Sweep prepare() = 0;
  /// One method at one setting, or a ladder of them.
  virtual std::vector<SweepPoint> run(std::size_t job) = 0;
};

/// One function a subject; sweep.cpp lists them. The scene must outlive the subject.
std::unique_ptr<SweepSubject> sweep_view_factors(const Scene& scene, const SweepArguments& a);
std::unique_ptr<SweepSubject> sweep_radiosity(const Scene& scene, const SweepArguments& a);
std::unique_ptr<SweepSubject> sweep_irradiance(const Scene& scene, const SweepArguments& a);

/// Marks the Pareto front of time and error: who takes longer must be better by one percent of the
/// error. Errors below `resolved` count as equal.
void mark_front(std::vector<SweepPoint>& points, double resolved = 0.0);

/// Points of a job, and what a sweep says of itself, as a ledger keeps them.
nlohmann::json to_json(const std::vector<SweepPoint>& points);
nlohmann::json shared_json(const Sweep& sweep);

/// The sweep of a ledger whose jobs are all done.
Sweep sweep_of(const RunLedger& ledger);

/// Table on stdout, and the files asked for: JSON, SVG, folder with a report. The exit code.
int present(const Sweep& sweep, const SweepArguments& arguments,
            const std::vector<std::pair<std::string, std::string>>& provenance);

}  // namespace truebox::app

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "scene/scene.h"

namespace truebox::app {

/// One method at one setting: what it cost and how wrong it was.
struct SweepPoint {
  std::string method, setting;
  double cpu_s = 0.0;       ///< one thread
  double error = 0.0;       ///< against the sweep's reference
  double bound_held = 1.0;  ///< share of the answers whose error was within their stated bound
  bool on_front = false;    ///< no other point is both faster and better
};

/// Error against time for several methods on the same work.
struct Sweep {
  std::string title;       ///< what was computed
  std::string error_name;  ///< "rms relative error of 120 view factors"
  std::string reference;   ///< what the error is against, and how good that is
  std::vector<SweepPoint> points;
};

struct SweepArguments {
  std::string scene, of, json, plot;
  std::string from, to;        ///< names of surfaces, all if empty
  double time_limit_s = 20.0;  ///< of one point; a method's finer settings are left out beyond
  bool quiet = false;
};

/// Marks the Pareto front of time and error.
void mark_front(std::vector<SweepPoint>& points);

/// One function a subject; sweep.cpp lists them.
Sweep sweep_view_factors(const Scene& scene, const SweepArguments& arguments);
Sweep sweep_radiosity(const Scene& scene, const SweepArguments& arguments);

}  // namespace truebox::app

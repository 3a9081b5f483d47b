// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <map>

#include "fit/scene_shape.h"

namespace truebox {
namespace {

constexpr double kLongest_px = 3.0;  // of one round

const FittedParameter* find(const SceneFit& fit, const std::string& name) {
  const auto found = std::find_if(fit.parameters.begin(), fit.parameters.end(),
                                  [&](const FittedParameter& p) { return p.name == name; });
  return found == fit.parameters.end() ? nullptr : &*found;
}

void fit_rounds(SceneFitProblem& problem, ShapedScene& shaped, const ShapeFitOptions& options,
                SceneFit& fit) {
  problem.model = shaped.model.get();
  problem.shape.clear();
  const bool any = std::any_of(shaped.unknowns.begin(), shaped.unknowns.end(),
                               [](const ShapeUnknown& u) { return u.hold != Hold::fixed; });
  SceneFitOptions how = options;
  fit = fit_scene(problem, how);  // what is in it of all else, before anything moves
  if (!any || fit.stopped || fit.summary.outcome == Outcome::invalid_problem) return;
  std::map<std::string, double> first;
  for (const FittedParameter& p : fit.parameters) first[p.name] = p.start;
  for (const ShapeUnknown& u : shaped.unknowns) first[u.name.name] = u.known;
  std::vector<FitStep> history = fit.history;
  int iterations = fit.summary.iterations;
  bool still = false;
  for (int round = 0; round < options.most_rounds && !still; ++round) {
    problem.shape = shaped.linearised(fit.state);
    for (const FittedParameter& p : fit.parameters) how.start[p.name] = p.estimate.value;
    for (std::size_t k = 0; k < shaped.values.size(); ++k)
      how.start[shaped.unknowns[k].name.name] = shaped.values[k];
    fit = fit_scene(problem, how);
    for (FitStep step : fit.history) {
      step.iteration = static_cast<int>(history.size());
      history.push_back(step);
    }
    iterations += fit.summary.iterations;
    still = true;
    std::vector<double> at = shaped.values;
    for (std::size_t k = 0; k < at.size(); ++k)
      if (const FittedParameter* p = find(fit, shaped.unknowns[k].name.name)) {
        const double moved = std::abs(p->estimate.value - at[k]);
        const double u = p->estimate.standard_uncertainty;
        still =
            still && !p->at_bound && moved <= options.tolerance * (u > 0.0 ? u : shaped.size_of(k));
        at[k] = p->estimate.value;
      }
    if (fit.stopped) break;
    // The straight line is trusted as far as edges stay in their windows.
    const double moves_px = shaped.motion_px(shaped.values, at);
    if (moves_px > kLongest_px) {
      still = false;
      for (std::size_t k = 0; k < at.size(); ++k)
        at[k] = shaped.values[k] + (at[k] - shaped.values[k]) * kLongest_px / moves_px;
    }
    shaped.move_to(at);
    problem.model = shaped.model.get();
    for (ShapeTerm& term : problem.shape)
      for (std::size_t k = 0; k < at.size(); ++k)
        if (shaped.unknowns[k].name.name == term.name.name) term.at = at[k];
  }
  if (!still && fit.summary.outcome != Outcome::rank_deficient) {
    fit.summary.outcome = Outcome::not_converged;
    if (!fit.stopped) fit.summary.message = "cameras or surfaces still move from round to round";
  }
  fit.history = std::move(history);
  fit.summary.iterations = iterations;
  for (FittedParameter& p : fit.parameters)
    if (const auto start = first.find(p.name); start != first.end()) {
      p.start = start->second;
      if (std::abs(p.estimate.value - p.start) > 1e-9 * std::max(std::abs(p.start), 1e-3))
        p.at_initial_value = false;
      // Said of where the last round began.
      constexpr const char* kStays = "at its initial value";
      const std::size_t said = p.note.find(kStays);
      if (p.at_initial_value || said == std::string::npos) continue;
      p.note.erase(said, std::string(kStays).size());
      if (p.note.substr(said).starts_with("; ")) p.note.erase(said, 2);
      if (p.note.ends_with("; ")) p.note.erase(p.note.size() - 2);
    }
}

}  // namespace

SceneFit fit_shaped_scene(SceneFitProblem& problem, ShapedScene& shaped,
                          const ShapeFitOptions& options) {
  SceneFit fit;
  try {
    fit_rounds(problem, shaped, options, fit);
  } catch (const FitStopped&) {
    if (fit.summary.outcome == Outcome::not_run) throw;
    fit.stopped = true;
    fit.summary.outcome = Outcome::not_converged;
    fit.summary.message = "stopped by the user: the best so far";
  }
  return fit;
}

}  // namespace truebox

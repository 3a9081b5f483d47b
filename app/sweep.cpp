// SPDX-License-Identifier: BSD-3-Clause
#include "sweep.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "figures/line_plot.h"
#include "image/image_file.h"
#include "scene/scene_file.h"
#include "view_factor_commands.h"

namespace truebox::app {
namespace {

struct Subject {
  const char* name;
  Sweep (*run)(const Scene& scene, const SweepArguments& arguments);
};
constexpr Subject kSubjects[] = {{"viewfactors", sweep_view_factors},
                                 {"radiosity", sweep_radiosity}};

void print(const Sweep& sweep) {
  fmt::print("{}\nerror: {}\nagainst: {}\n{:<22}{:<22}{:>12}{:>12}{:>12}\n", sweep.title,
             sweep.error_name, sweep.reference, "method", "setting", "time / s", "error",
             "bound held");
  for (const SweepPoint& p : sweep.points)
    fmt::print("{:<22}{:<22}{:>12.3g}{:>12.2e}{:>10.1f} %{}\n", p.method, p.setting, p.cpu_s,
               p.error, 100.0 * p.bound_held, p.on_front ? "  front" : "");
}

nlohmann::json as_json(const Sweep& sweep) {
  nlohmann::json points = nlohmann::json::array();
  for (const SweepPoint& p : sweep.points)
    points.push_back({{"method", p.method},
                      {"setting", p.setting},
                      {"cpu_s", p.cpu_s},
                      {"error", p.error},
                      {"bound_held", p.bound_held},
                      {"on_front", p.on_front}});
  return {{"title", sweep.title},
          {"error", sweep.error_name},
          {"reference", sweep.reference},
          {"points", points}};
}

std::string as_svg(const Sweep& sweep) {
  LinePlot plot;
  plot.title = sweep.title + ": error against time";
  plot.x = {"time", "s", true};
  plot.y = {sweep.error_name, "1", true};
  PlotSeries front{"Pareto front", {}, {}};
  front.dashed = true;
  for (const SweepPoint& p : sweep.points) {
    auto series = std::find_if(plot.series.begin(), plot.series.end(),
                               [&](const PlotSeries& s) { return s.name == p.method; });
    if (series == plot.series.end()) {
      plot.series.push_back({p.method, {}, {}});
      plot.series.back().markers = true;
      series = plot.series.end() - 1;
    }
    series->x.push_back(p.cpu_s);
    series->y.push_back(p.error);
  }
  std::vector<SweepPoint> best;
  std::copy_if(sweep.points.begin(), sweep.points.end(), std::back_inserter(best),
               [](const SweepPoint& p) { return p.on_front; });
  std::sort(best.begin(), best.end(),
            [](const SweepPoint& a, const SweepPoint& b) { return a.cpu_s < b.cpu_s; });
  for (const SweepPoint& p : best) {
    front.x.push_back(p.cpu_s);
    front.y.push_back(p.error);
  }
  plot.series.push_back(std::move(front));
  return to_svg(plot);
}

int sweep(const SweepArguments& a) {
  const Scene scene = read_scene(a.scene);
  for (const Subject& subject : kSubjects) {
    if (a.of != subject.name) continue;
    Sweep result = subject.run(scene, a);
    mark_front(result.points);
    print(result);
    if (!a.json.empty()) write_file_atomically(a.json, as_json(result).dump(1) + "\n");
    if (!a.plot.empty()) write_file_atomically(a.plot, as_svg(result));
    return kAgrees;
  }
  return kUsage;
}

}  // namespace

void mark_front(std::vector<SweepPoint>& points) {
  for (SweepPoint& p : points)
    p.on_front = std::none_of(points.begin(), points.end(), [&](const SweepPoint& q) {
      return q.cpu_s <= p.cpu_s && q.error <= p.error && (q.cpu_s < p.cpu_s || q.error < p.error);
    });
}

void add_sweep_command(CLI::App& program, Action& chosen) {
  auto* command = program.add_subcommand(
      "sweep", "speed against accuracy over methods and settings; the Pareto front");
  auto a = std::make_shared<SweepArguments>();
  std::vector<std::string> subjects;
  for (const Subject& subject : kSubjects) subjects.emplace_back(subject.name);
  command->add_option("SCENE", a->scene, "scene file (TOML)")->required();
  command->add_option("--of", a->of, "what to compute")->required()->check(CLI::IsMember(subjects));
  command->add_option("--json", a->json, "every number as JSON");
  command->add_option("--plot", a->plot, "error against time as SVG");
  command->add_option("--from", a->from, "of viewfactors: only from this surface");
  command->add_option("--to", a->to, "of viewfactors: only to this surface");
  command->add_option("--time-limit", a->time_limit_s, "s of one point of the sweep")
      ->capture_default_str()
      ->check(CLI::Range(0.01, 3600.0));
  command->add_flag("--quiet", a->quiet, "no progress");
  command->footer(
      "Example: truebox sweep reference/independent_renders/closed_box.toml --of viewfactors "
      "--plot trade.svg");
  command->callback([=, &chosen] { chosen = [=] { return sweep(*a); }; });
}

}  // namespace truebox::app

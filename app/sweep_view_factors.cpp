// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <cmath>

#include "prediction_options.h"
#include "radiometry/input_error.h"
#include "radiometry/processor_time.h"
#include "sweep.h"
#include "transport/view_factors.h"

namespace truebox::app {
namespace {

struct Reference {
  std::size_t i, j;
  double exchange_m2, bound_m2;
};

struct Setting {
  std::string name;
  ViewFactorOptions options;
};

// From rough to fine: a method stops where one point costs too much.
std::vector<std::vector<Setting>> ladders() {
  const auto with = [](ViewFactorMethod method, std::string name, const auto& change) {
    Setting setting{std::move(name), {}};
    setting.options.method = method;
    change(setting.options);
    return setting;
  };
  std::vector<std::vector<Setting>> all;
  for (ViewFactorMethod method : {ViewFactorMethod::planned, ViewFactorMethod::exact_visibility}) {
    auto& ladder = all.emplace_back();
    for (double t : {1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10})
      ladder.push_back(with(method, fmt::format("tolerance {:.0e}", t),
                            [&](auto& o) { o.relative_tolerance = t; }));
  }
  all.push_back({with(ViewFactorMethod::analytic, "nothing between", [](auto&) {})});
  auto& rays = all.emplace_back();
  for (int n : {4, 8, 16, 32, 128, 512, 2048, 8192, 32768})
    rays.push_back(with(ViewFactorMethod::ray_casting, fmt::format("{} rays", n),
                        [&](auto& o) { o.rays = n; }));
  auto& nusselt = all.emplace_back();
  for (int n : {4, 16, 64, 256})
    nusselt.push_back(
        with(ViewFactorMethod::nusselt, fmt::format("{} arcs an edge", n), [&](auto& o) {
          o.arcs = n;
          o.relative_tolerance = 1e-5;
        }));
  auto& hemicube = all.emplace_back();
  for (int n : {16, 32, 64, 128, 256, 512})
    hemicube.push_back(with(ViewFactorMethod::hemicube, fmt::format("{} pixels an edge", n),
                            [&](auto& o) { o.resolution = n; }));
  return all;
}

std::vector<Reference> references(const Scene& scene, const ViewFactors& factors,
                                  const SweepArguments& a) {
  const auto chosen = [&](std::size_t s, const std::string& name) {
    return name.empty() || scene.surfaces[s].name == name;
  };
  ViewFactorOptions options;
  options.relative_tolerance = 1e-11;
  options.most_evaluations = 4'000'000;
  const auto progress = terminal_progress(a.quiet);
  std::vector<Reference> pairs;
  const std::size_t n = scene.surfaces.size();
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i; j < n; ++j) {
      const bool forth = chosen(i, a.from) && chosen(j, a.to);
      if (!forth && !(chosen(j, a.from) && chosen(i, a.to))) continue;
      const auto found = factors.between(i, j, options);
      if (found.exchange_area_m2 > found.error_bound_m2)
        pairs.push_back({i, j, found.exchange_area_m2, found.error_bound_m2});
    }
    if (progress) progress("reference", static_cast<double>(i + 1) / static_cast<double>(n));
  }
  return pairs;
}

SweepPoint measure(const ViewFactors& factors, const std::vector<Reference>& pairs,
                   const Setting& setting) {
  SweepPoint point;
  point.method = name_of(setting.options.method);
  point.setting = setting.name;
  std::vector<ViewFactorEstimate> found;
  const double start = thread_cpu_s();
  for (const Reference& pair : pairs)
    found.push_back(factors.between(pair.i, pair.j, setting.options));
  point.cpu_s = thread_cpu_s() - start;
  std::size_t held = 0;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const double error = found[k].exchange_area_m2 - pairs[k].exchange_m2;
    held += std::abs(error) <= found[k].error_bound_m2 + pairs[k].bound_m2;
    const double relative = error / pairs[k].exchange_m2;
    point.largest_error = std::max(point.largest_error, std::abs(relative));
    point.bound +=
        found[k].error_bound_m2 / pairs[k].exchange_m2 / static_cast<double>(pairs.size());
    point.error += relative * relative / static_cast<double>(pairs.size());
  }
  // Below what the reference is good to nothing can be told, and a plot has no 0.
  double floor = 1e-16;
  for (const Reference& pair : pairs) floor = std::max(floor, pair.bound_m2 / pair.exchange_m2);
  point.error = std::max(std::sqrt(point.error), floor);
  point.bound_held = static_cast<double>(held) / static_cast<double>(pairs.size());
  return point;
}

class ViewFactorSweep : public SweepSubject {
 public:
  ViewFactorSweep(const Scene& scene, const SweepArguments& a)
      : scene_(scene), arguments_(a), factors_(scene), ladders_(ladders()) {
    for (const std::string& name : {a.from, a.to})
      if (!name.empty() && std::none_of(scene.surfaces.begin(), scene.surfaces.end(),
                                        [&](const Surface& s) { return s.name == name; }))
        throw InputError(scene.path, 0, "a surface of the scene", '"' + name + '"');
  }

  std::vector<std::string> jobs() const override {
    std::vector<std::string> names;
    for (const auto& ladder : ladders_) names.emplace_back(name_of(ladder.front().options.method));
    return names;
  }

  Sweep prepare() override {
    pairs_ = references(scene_, factors_, arguments_);
    if (pairs_.empty()) throw InputError(scene_.path, 0, "surfaces that see each other", "none");
    double bound = 0.0;
    for (const Reference& pair : pairs_) bound = std::max(bound, pair.bound_m2 / pair.exchange_m2);
    Sweep sweep;
    sweep.title = fmt::format("View factors of {} pairs of {}", pairs_.size(), scene_.path);
    sweep.error_name = "rms relative error";
    sweep.reference = fmt::format("exact visibility, largest relative bound {:.1e}", bound);
    sweep.floor = bound;
    return sweep;
  }

  std::vector<SweepPoint> run(std::size_t job) override {
    std::vector<SweepPoint> points;
    for (const Setting& setting : ladders_[job]) {
      points.push_back(measure(factors_, pairs_, setting));
      if (points.back().cpu_s > arguments_.time_limit_s / 4.0) break;
    }
    return points;
  }

 private:
  const Scene& scene_;
  const SweepArguments& arguments_;
  ViewFactors factors_;
  std::vector<std::vector<Setting>> ladders_;
  std::vector<Reference> pairs_;
};

}  // namespace

std::unique_ptr<SweepSubject> sweep_view_factors(const Scene& scene, const SweepArguments& a) {
  return std::make_unique<ViewFactorSweep>(scene, a);
}

}  // namespace truebox::app

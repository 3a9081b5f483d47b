// SPDX-License-Identifier: BSD-3-Clause
// Error of irradiance against the number of elements: uniform, adapted, and elements that follow
// lines of light. The measure: root mean square error over the area of all lit surfaces, over the
// mean irradiance (and of relative errors); three bands of the Cornell Box. Truth: gathered
// irradiance at points that belong to no mesh (support/irradiance_truth.h); what two truths differ
// by is printed first.
#include <fmt/format.h>

#include <cstdlib>
#include <fstream>
#include <functional>

#include "adaptive/adaptive_solution.h"
#include "figures/line_plot.h"
#include "radiometry/processor_time.h"
#include "scene/scene_file.h"
#include "support/irradiance_truth.h"

namespace truebox::benchmark {
namespace {

using Predict = std::function<std::unique_ptr<Prediction>(const Scene&, const PredictOptions&)>;

struct Candidate {
  std::string name;
  Predict predict;
  std::vector<std::size_t> elements;
};

Predict adapted(const char* goal, bool lines) {
  return [goal, lines](const Scene& s, const PredictOptions& o) {
    return predict_adaptively(s, o, goal_of_name(goal, s), nullptr, lines);
  };
}

std::vector<Candidate> candidates(std::size_t most) {
  const Predict uniform = [](const Scene& s, const PredictOptions& o) {
    return std::make_unique<Prediction>(s, o);
  };
  const Predict uniform_near = [](const Scene& s, PredictOptions o) {
    o.near_sources = true;
    return std::make_unique<Prediction>(s, o);
  };
  const Predict lines = [](const Scene& s, const PredictOptions& o) {
    return predict_along_discontinuities(s, o);
  };
  std::vector<std::size_t> few = {800, 1600, 3200}, many = {1200, 4600};
  if (most > 4600) {
    few.push_back(most);
    many.push_back(2 * most);
  }
  return {{"uniform", uniform, many},
          {"uniform, near sources", uniform_near, many},
          {"lines of light", lines, {800, 1600, 3200}},
          {"adapted everywhere", adapted("everywhere", false), {800, 1600, 3200}},
          {"adapted to irradiance, lines", adapted("irradiance", true), {800, 1600, 3200}},
          {"adapted to irradiance", adapted("irradiance", false), few}};
}

std::vector<MeasuredPlace> measured_places(const Scene& scene, double truth_edge_m) {
  auto places = places_on_surfaces(scene, 0.06);
  auto other = places;
  const auto coarse = solve_truth(scene, 1.3 * truth_edge_m);
  gather_truth(*coarse, other);
  const auto fine = solve_truth(scene, truth_edge_m);
  gather_truth(*fine, places);
  const FieldError difference = rms_error(places, [&](std::size_t i) -> Eigen::VectorXd {
    return places[i].indirect - other[i].indirect;
  });
  fmt::print(
      "{} places; truth from {} elements; one from {} differs by {:.3f} % of the "
      "mean, {:.3f} % relative\n",
      places.size(), fine->fine().mesh.size(), coarse->fine().mesh.size(),
      100.0 * difference.to_mean, 100.0 * difference.relative);
  std::fflush(stdout);
  return places;
}

void run(std::size_t most, double truth_edge_m, const std::string& svg) {
  const Scene scene =
      in_bands_at(read_scene(std::string(TRUEBOX_REFERENCE_DIR) + "/cornell_box/cornell_box.toml"),
                  {452.0, 552.0, 652.0});
  PredictOptions options;
  options.form_factors.method = FormFactorMethod::exact_visibility;
  const auto places = measured_places(scene, truth_edge_m);
  LinePlot plot{"rms error of irradiance against elements",
                {"elements", "1", true, {}},
                {"rms error : mean irradiance", "1", true, {}},
                {}};
  fmt::print("| mesh | elements | processor time / s | rms : mean | rms relative |\n");
  for (const Candidate& candidate : candidates(most)) {
    PlotSeries& line = plot.series.emplace_back();
    line.name = candidate.name;
    line.markers = true;
    for (const std::size_t elements : candidate.elements) {
      options.elements = elements;
      const double start_s = process_cpu_s();
      const auto prediction = candidate.predict(scene, options);
      const double solve_s = process_cpu_s() - start_s;
      const FieldError e = field_error(*prediction, places);
      fmt::print("| {} | {} | {:.1f} | {:.3f} % | {:.2f} % |\n", candidate.name,
                 prediction->fine().mesh.size(), solve_s, 100.0 * e.to_mean, 100.0 * e.relative);
      std::fflush(stdout);
      line.x.push_back(static_cast<double>(prediction->fine().mesh.size()));
      line.y.push_back(e.to_mean);
    }
  }
  if (!svg.empty()) std::ofstream(svg) << to_svg(plot);
}

}  // namespace
}  // namespace truebox::benchmark

// truebox_mesh_benchmark [MOST ELEMENTS [EDGE OF THE TRUTH'S CELLS [PLOT.svg]]]
int main(int count, char** argument) {
  truebox::benchmark::run(count > 1 ? std::strtoul(argument[1], nullptr, 10) : 0,
                          count > 2 ? std::strtod(argument[2], nullptr) : 0.14,
                          count > 3 ? argument[3] : "");
}

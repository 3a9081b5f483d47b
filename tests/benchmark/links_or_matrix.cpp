// SPDX-License-Identifier: BSD-3-Clause
// Links or a matrix: what the whole error of an answer costs. Both work on the same uniform meshes
// of the closed box, one thread; the error is that of the field (what pictures show) against a
// truth gathered from elements that belong to none of them (support/irradiance_truth.h), so that it
// holds the error of the mesh and that of the exchange alike. At equal error the two are compared
// by interpolation between sizes, and the size from which on links take less time is printed.
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <limits>
#include <string>

#include "adaptive/adaptive_solution.h"
#include "hierarchy/hierarchical_exchange.h"
#include "radiometry/processor_time.h"
#include "scene/scene_file.h"
#include "support/irradiance_truth.h"

namespace truebox::benchmark {
namespace {

constexpr std::size_t kLargestMatrix = 11000;
constexpr int kRepetitions = 3;  // what else runs takes from the caches: the least time counts
constexpr double kTruthEdge_m = 0.14;

struct Cost {
  std::size_t elements = 0;
  double tolerance = 0.0;  // of links; 0: a matrix
  double processor_s = 0.0, error = 0.0;
  std::size_t bytes = 0;
};

Scene closed_box() {
  return in_bands_at(
      read_scene(std::string(TRUEBOX_REFERENCE_DIR) + "/independent_renders/closed_box.toml"),
      {450.0, 550.0, 650.0});
}

std::vector<MeasuredPlace> places_with_truth(const Scene& scene) {
  auto places = places_on_surfaces(scene, 0.06);
  auto other = places;
  const auto coarse = solve_truth(scene, 1.3 * kTruthEdge_m);
  gather_truth(*coarse, other);
  const auto fine = solve_truth(scene, kTruthEdge_m);
  gather_truth(*fine, places);
  const FieldError difference = rms_error(places, [&](std::size_t i) -> Eigen::VectorXd {
    return places[i].indirect - other[i].indirect;
  });
  fmt::print("{} places; truth from {} elements; one from {} differs by {:.3f} % of the mean\n",
             places.size(), fine->fine().mesh.size(), coarse->fine().mesh.size(),
             100.0 * difference.to_mean);
  return places;
}

// The finest grid alone: the two that a bound needs are a few elements here.
PredictOptions on_one_mesh(const Scene& scene, std::size_t elements) {
  PredictOptions options;
  options.near_sources = false;
  options.mesh_of_grid = [&scene, elements](int grid) {
    return uniform_mesh(scene, grid < 2 ? 1.0 : edge_for_count(scene, elements));
  };
  return options;
}

Cost measure(const std::vector<MeasuredPlace>& places, double tolerance,
             const std::function<std::unique_ptr<Prediction>()>& predict) {
  std::unique_ptr<Prediction> prediction;
  double least_s = std::numeric_limits<double>::infinity();
  for (int repetition = 0; repetition < kRepetitions; ++repetition) {
    prediction.reset();
    const double start_s = process_cpu_s();
    prediction = predict();
    least_s = std::min(least_s, process_cpu_s() - start_s);
  }
  const Prediction& p = *prediction;
  Cost cost{p.fine().mesh.size(), tolerance, least_s};
  cost.error = field_error(p, places).to_mean;
  const auto& links = p.fine().links;
  cost.bytes = links ? links->bytes : cost.elements * cost.elements * sizeof(double);
  fmt::print("| {} | {} | {} | {:.2f} | {} | {:.3f} % |\n", links ? "links" : "matrix",
             cost.elements, links ? fmt::format("{:g}", tolerance) : "", cost.processor_s,
             cost.bytes >> 20, 100.0 * cost.error);
  std::fflush(stdout);
  return cost;
}

Cost measure(const Scene& scene, const std::vector<MeasuredPlace>& places,
             const PredictOptions& options, double tolerance) {
  return measure(places, tolerance, [&] { return std::make_unique<Prediction>(scene, options); });
}

// The quicker of its usual setting and one that is accurate enough beside these meshes.
Cost measure_matrix(const Scene& scene, const std::vector<MeasuredPlace>& places,
                    std::size_t elements) {
  PredictOptions options = on_one_mesh(scene, elements);
  const Cost usual = measure(scene, places, options, 0.0);
  options.form_factors.outline_points = 2;
  options.form_factors.relative_tolerance = 1e-3;
  const Cost coarse = measure(scene, places, options, 0.0);
  return coarse.processor_s < usual.processor_s ? coarse : usual;
}

std::vector<Cost> measure_links(const Scene& scene, const std::vector<MeasuredPlace>& places,
                                std::size_t elements) {
  PredictOptions options = on_one_mesh(scene, elements);
  std::vector<Cost> costs;
  for (const double tolerance : {1e-2, 5e-3, 3e-3, 2e-3}) {
    options.find_exchange = hierarchical_exchange({.relative_tolerance = tolerance});
    costs.push_back(measure(scene, places, options, tolerance));
  }
  return costs;
}

// Drops what others do sooner and better; sorted by falling error.
std::vector<Cost> front_of(std::vector<Cost> costs) {
  std::sort(costs.begin(), costs.end(),
            [](const Cost& a, const Cost& b) { return a.processor_s < b.processor_s; });
  std::vector<Cost> front;
  for (const Cost& c : costs)
    if (front.empty() || c.error < front.back().error) front.push_back(c);
  return front;
}

// Of a matrix whose answer has this error, by a power law between two sizes or beyond the last.
Cost matrix_at(const std::vector<Cost>& matrices, double error) {
  std::size_t k = 1;
  while (k + 1 < matrices.size() && matrices[k].error > error) ++k;
  const Cost &a = matrices[k - 1], &b = matrices[k];
  const double t = std::log(error / a.error) / std::log(b.error / a.error);
  const auto between = [t](double x, double y) { return x * std::pow(y / x, t); };
  Cost cost{0, 0.0, between(a.processor_s, b.processor_s), error};
  cost.elements = static_cast<std::size_t>(
      between(static_cast<double>(a.elements), static_cast<double>(b.elements)));
  cost.bytes = cost.elements * cost.elements * sizeof(double);
  return cost;
}

void compare(const std::vector<Cost>& matrices, const std::vector<Cost>& links) {
  fmt::print(
      "\nAt equal error\n| error | matrix, elements | s | MiB | links, elements | tolerance | s | "
      "MiB | time, matrix : links |\n");
  double crossing = 0.0, before = 0.0, before_elements = 0.0;
  for (const Cost& c : front_of(links)) {
    const Cost m = matrix_at(matrices, c.error);
    const double ratio = m.processor_s / c.processor_s;
    fmt::print("| {:.3f} % | {} | {:.2f} | {} | {} | {:g} | {:.2f} | {} | {:.2f}{} |\n",
               100.0 * c.error, m.elements, m.processor_s, m.bytes >> 20, c.elements, c.tolerance,
               c.processor_s, c.bytes >> 20, ratio,
               c.error < matrices.back().error ? " (extrapolated)" : "");
    const auto elements = static_cast<double>(m.elements);
    if (ratio < 1.0)
      crossing = 0.0;  // from there on, and not before
    else if (crossing == 0.0)
      crossing = before > 0.0 && before < 1.0
                     ? before_elements * std::pow(elements / before_elements,
                                                  std::log(before) / std::log(before / ratio))
                     : elements;
    before = ratio, before_elements = elements;
  }
  if (crossing > 0.0)
    fmt::print("At equal error links take less time from a matrix of {:.0f} elements on.\n",
               crossing);
  else
    fmt::print("Links take more time at every size measured.\n");
}

// Meshes adapted to irradiance: search for the mesh, and all three grids of a prediction.
void compare_adapted(const Scene& scene, const std::vector<MeasuredPlace>& places) {
  fmt::print("\nAdapted meshes, three grids\n");
  for (const std::size_t elements : {3200u, 8000u})
    for (const double tolerance : {0.0, 3e-3, 2e-3}) {
      PredictOptions options;
      options.elements = elements;
      if (tolerance > 0.0)
        options.find_exchange = hierarchical_exchange({.relative_tolerance = tolerance});
      measure(places, tolerance, [&] {
        return predict_adaptively(scene, options, goal_of_name("irradiance", scene));
      });
    }
}

}  // namespace

void run(const std::vector<std::size_t>& sizes, bool with_adapted) {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const Scene scene = closed_box();
  const auto places = places_with_truth(scene);
  fmt::print("| exchange | elements | tolerance | processor time / s | MiB | rms error |\n");
  std::vector<Cost> matrices, links;
  for (const std::size_t n : sizes) {
    if (n <= kLargestMatrix) matrices.push_back(measure_matrix(scene, places, n));
    const auto more = measure_links(scene, places, n);
    links.insert(links.end(), more.begin(), more.end());
  }
  if (matrices.size() > 1) compare(matrices, links);
  if (with_adapted) compare_adapted(scene, places);
}

}  // namespace truebox::benchmark

// truebox_link_benchmark [ELEMENTS...]; 0: adapted meshes as well
int main(int count, char** argument) {
  std::vector<std::size_t> sizes;
  for (int k = 1; k < count; ++k) sizes.push_back(std::strtoul(argument[k], nullptr, 10));
  const bool with_adapted = std::erase(sizes, 0u) > 0;
  if (sizes.empty() && !with_adapted) sizes = {1200, 2400, 5000, 10000, 20000};
  truebox::benchmark::run(sizes, with_adapted);
}

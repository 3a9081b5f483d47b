// SPDX-License-Identifier: BSD-3-Clause
#include "planning/pilot.h"

#include <algorithm>
#include <cmath>

#include "adaptive/adaptive_solution.h"
#include "path_tracer/path_tracer.h"
#include "planning/field_error.h"
#include "radiometry/processor_time.h"
#include "sensor/camera.h"
#include "transport/predict_to_target.h"

namespace truebox {
namespace {

constexpr double kReserve = 1.15, kSmallestStep = 1.5;  // as predict_to_target takes
constexpr double kBoundOrder = 3.0 / 4;                 // the bound falls like elements^-this
// And the rms error of the field: measured, solver/README.md.
constexpr double kFieldOrder = 0.6, kAdaptedFieldOrder = 1.0;
constexpr double kLeastCostExponent = 1.6;  // measured from 2400 to 10,000 elements
constexpr double kSmaller = 1.0 / 3.0;      // of the solve that the cost's growth is taken from

// How much of the light comes by reflection, in the band where that is most.
double indirect_share(const Prediction& prediction) {
  const GridSolution& grid = prediction.fine();
  Eigen::VectorXd indirect = Eigen::VectorXd::Zero(grid.direct.cols()), all = indirect;
  for (std::size_t i = 0; i < grid.mesh.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const double area = grid.mesh.patches[i].area_m2;
    indirect += area * grid.indirect.row(row).transpose();
    all += area * (grid.direct.row(row) + grid.indirect.row(row)).transpose();
  }
  double largest = 0.0;
  for (Eigen::Index k = 0; k < all.size(); ++k)
    if (all[k] > 0.0) largest = std::max(largest, indirect[k] / all[k]);
  return largest;
}

std::unique_ptr<Prediction> timed_solve(const Scene& scene, PredictOptions options,
                                        const std::optional<Goal>& adapted_to,
                                        double& processor_s) {
  options.error_shares = false;
  const double start = process_cpu_s();
  auto prediction = adapted_to ? predict_adaptively(scene, options, *adapted_to)
                               : std::make_unique<Prediction>(scene, options);
  processor_s = process_cpu_s() - start;
  return prediction;
}

}  // namespace

double Pilot::error() const {
  return measure == ErrorMeasure::rms_irradiance ? field_error : relative_bound;
}

double Pilot::elements_for(double wanted_error) const {
  if (error() <= wanted_error) return static_cast<double>(elements);
  const double from = measure == ErrorMeasure::rms_irradiance ? field_error : bound_in_order;
  return static_cast<double>(elements) *
         std::max(kSmallestStep, kReserve * std::pow(from / wanted_error, 1.0 / error_order));
}

double Pilot::error_for(double wanted_elements) const {
  return error() *
         std::pow(kReserve * static_cast<double>(elements) / wanted_elements, error_order);
}

double Pilot::processor_s_for(double wanted_elements) const {
  return processor_s * std::pow(wanted_elements / static_cast<double>(elements), cost_exponent);
}

Pilot fly_pilot(const Scene& scene, const PredictOptions& options,
                const std::optional<Goal>& adapted_to, ErrorMeasure measure) {
  const auto solve = [&](std::size_t elements, double& processor_s) {
    PredictOptions attempt = options;
    attempt.elements = elements;
    return timed_solve(scene, attempt, adapted_to, processor_s);
  };
  Pilot pilot;
  pilot.measure = measure;
  pilot.error_order = measure == ErrorMeasure::bound_of_means ? kBoundOrder
                      : adapted_to                            ? kAdaptedFieldOrder
                                                              : kFieldOrder;
  double small_s = 0.0;
  const auto smaller =
      solve(static_cast<std::size_t>(kSmaller * static_cast<double>(options.elements)), small_s);
  const auto prediction = solve(options.elements, pilot.processor_s);
  const GridSolution& grid = prediction->fine();
  pilot.elements = grid.mesh.size();
  const double growth =
      static_cast<double>(pilot.elements) / static_cast<double>(smaller->fine().mesh.size());
  // What grows with the pairs overtakes the rest beyond the pilot; two sizes alike tell nothing.
  if (growth > 1.5 && small_s > 0.0)
    pilot.cost_exponent = std::clamp(std::log(pilot.processor_s / small_s) / std::log(growth),
                                     kLeastCostExponent, 2.0);
  const RelativeBound bound = relative_bound_of_surfaces(*prediction);
  pilot.relative_bound = bound.value;
  pilot.bound_in_order = bound.in_order;
  if (measure == ErrorMeasure::rms_irradiance) pilot.field_error = field_error(*prediction);
  pilot.indirect_share = indirect_share(*prediction);
  pilot.form_factors = grid.form_factors;
  pilot.matrix_passes = grid.solve.matrix_passes;
  pilot.bands_reduced = grid.solve.bands_reduced;
  return pilot;
}

Pilot fly_single_pilot(const Scene& scene, const PredictOptions& options) {
  Pilot pilot;
  pilot.elements = timed_solve(scene, options, std::nullopt, pilot.processor_s)->fine().mesh.size();
  return pilot;
}

double PathPilot::paths_for(double wanted_standard_error) const {
  const double ratio = standard_error / wanted_standard_error;
  return std::max(16.0, static_cast<double>(paths) * ratio * ratio);
}

PathPilot fly_path_pilot(const Scene& scene, const CameraDescription& description) {
  CameraDescription small = description;
  const double shrink =
      std::max(1.0, std::sqrt(small.pixels[0] * static_cast<double>(small.pixels[1]) / 1024.0));
  for (int& n : small.pixels) n = std::max(1, static_cast<int>(n / shrink));
  const Camera camera(small);
  PathTraceOptions options;
  options.samples = 64;
  const double start = process_cpu_s();
  const PathTracedImage image = trace_paths(
      scene, camera.width_px(), camera.height_px(),
      [&](int x, int y, UnitPair at) -> std::optional<PixelRay> {
        const auto ray = camera.ray({x + at.u, y + at.v});
        if (!ray) return std::nullopt;
        return PixelRay{ray->origin_m, ray->direction};
      },
      options);
  PathPilot pilot;
  pilot.processor_s = process_cpu_s() - start;
  pilot.paths = image.samples;
  pilot.pixels = camera.width_px() * camera.height_px();
  std::vector<double> shares;
  for (std::size_t c = 0; c < image.variance.channels.size(); ++c)
    for (std::size_t i = 0; i < image.variance.pixel_count(); ++i)
      if (const double value = image.radiance.channels[c].samples[i]; value > 0.0)
        shares.push_back(std::sqrt(image.variance.channels[c].samples[i]) / value);
  if (shares.empty()) return pilot;
  const auto middle = shares.begin() + static_cast<std::ptrdiff_t>(shares.size() / 2);
  std::nth_element(shares.begin(), middle, shares.end());
  pilot.standard_error = *middle;
  return pilot;
}

}  // namespace truebox

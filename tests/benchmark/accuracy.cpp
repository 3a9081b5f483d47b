// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <map>
#include <memory>
#include <string>

#include "benchmark.h"
#include "radiometry/table_file.h"
#include "transport/prediction.h"

namespace truebox::benchmark {
namespace {

struct Probe {
  Vec3 point_m, normal;
};

std::map<std::string, Probe> read_probes(const std::filesystem::path& path,
                                         double metres_per_unit) {
  const TableFile table = read_table(path);
  std::map<std::string, Probe> probes;
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    Probe probe;
    for (std::size_t k = 0; k < 3; ++k) {
      probe.point_m[static_cast<Eigen::Index>(k)] = metres_per_unit * table.number(row, 1 + k);
      probe.normal[static_cast<Eigen::Index>(k)] = table.number(row, 4 + k);
    }
    probes[table.rows[row][0]] = {probe.point_m, probe.normal.normalized()};
  }
  return probes;
}

std::size_t nearest_band(const WavelengthGrid& bands, double wavelength_nm) {
  std::size_t nearest = 0;
  for (std::size_t b = 1; b < bands.size(); ++b)
    if (std::abs(bands.centre_nm(b) - wavelength_nm) <
        std::abs(bands.centre_nm(nearest) - wavelength_nm))
      nearest = b;
  return nearest;
}

}  // namespace

Accuracy measure_accuracy(const Scene& scene, const std::filesystem::path& reference_dir,
                          std::size_t elements) {
  const auto renders = reference_dir / "independent_renders";
  const auto probes = read_probes(renders / "probe_points.csv", scene.metres_per_unit);
  const TableFile truth = read_table(renders / "probe_irradiance.csv");
  PredictOptions options;
  options.elements = elements;
  Accuracy result;
  std::unique_ptr<Prediction> prediction;
  result.solve_s = seconds([&] { prediction = std::make_unique<Prediction>(scene, options); });
  result.elements = prediction->fine().mesh.size();
  result.coarse_elements = prediction->coarse().mesh.size();
  std::map<std::string, BoundedIrradiance> answers;
  result.probe_s = seconds([&] {
    for (const auto& [name, probe] : probes)
      answers[name] = prediction->irradiance_at(probe.point_m, probe.normal);
  });
  for (std::size_t row = 0; row < truth.rows.size(); ++row) {
    const double expected = truth.number(row, 2), standard_error = truth.number(row, 3);
    if (expected <= 0.0) continue;
    const auto band = static_cast<Eigen::Index>(nearest_band(scene.bands, truth.number(row, 1)));
    const BoundedIrradiance& answer = answers.at(truth.rows[row][0]);
    const double difference = std::abs(answer.value[band] - expected);
    const double bound = answer.error_bound[band];
    ++result.compared;
    result.rms_error += std::pow(difference / expected, 2);
    result.max_error = std::max(result.max_error, difference / expected);
    result.rms_standard_error += std::pow(standard_error / expected, 2);
    result.mean_bound += bound / expected;
    result.covered += difference <= bound + 2.0 * standard_error ? 1.0 : 0.0;
  }
  const auto count = static_cast<double>(result.compared);
  result.rms_error = std::sqrt(result.rms_error / count);
  result.rms_standard_error = std::sqrt(result.rms_standard_error / count);
  result.mean_bound /= count;
  result.covered /= count;
  return result;
}

}  // namespace truebox::benchmark

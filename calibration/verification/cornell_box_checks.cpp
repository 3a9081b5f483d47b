// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "provenance/provenance.h"
#include "radiometry/table_file.h"
#include "scene/scene_file.h"
#include "transport/prediction.h"
#include "verification/accuracy_check.h"

namespace truebox {

std::vector<AccuracyCheck> check_cornell_box_probes(const std::filesystem::path& reference_dir,
                                                    std::size_t elements) {
  const Scene scene = read_scene(reference_dir / "cornell_box" / "cornell_box.toml");
  PredictOptions options;
  options.elements = elements;
  const Prediction prediction(scene, options);
  return check_cornell_box_probes(reference_dir, prediction);
}

std::vector<AccuracyCheck> check_cornell_box_probes(const std::filesystem::path& reference_dir,
                                                    const Prediction& prediction) {
  const Scene& scene = prediction.scene();
  const TableFile points = read_table(reference_dir / "independent_renders" / "probe_points.csv");
  const TableFile truth =
      read_table(reference_dir / "independent_renders" / "probe_irradiance.csv");
  require_provenance(truth);
  std::vector<AccuracyCheck> checks;
  for (std::size_t i = 0; i < points.rows.size(); ++i) {
    Vec3 x, normal;
    for (std::size_t k = 0; k < 3; ++k) {
      x[static_cast<Eigen::Index>(k)] = 1e-3 * points.number(i, 1 + k);
      normal[static_cast<Eigen::Index>(k)] = points.number(i, 4 + k);
    }
    const BoundedIrradiance e = prediction.irradiance_at(x, normal.normalized());
    for (std::size_t row = 0; row < truth.rows.size(); ++row) {
      if (truth.rows[row][0] != points.rows[i][0]) continue;
      const double nm = truth.number(row, 1);
      for (std::size_t b = 0; b < scene.bands.size(); ++b) {
        if (std::abs(scene.bands.centre_nm(b) - nm) > 1e-6) continue;
        const auto k = static_cast<Eigen::Index>(b);
        checks.push_back(
            {"cornellbox", points.rows[i][0] + ", " + truth.rows[row][1] + " nm", e.value[k],
             truth.number(row, 2), e.error_bound[k] + 3.0 * truth.number(row, 3), "W m^-2 nm^-1",
             "own bound " +
                 std::to_string(100.0 * e.error_bound[k] / std::max(1e-300, e.value[k])) +
                 " % + 3 standard errors of the path tracer"});
      }
    }
  }
  return checks;
}

}  // namespace truebox

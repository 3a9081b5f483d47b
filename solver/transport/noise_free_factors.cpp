// SPDX-License-Identifier: BSD-3-Clause
#include "transport/noise_free_factors.h"

#include <algorithm>
#include <cmath>

#include "transport/exact_form_factors.h"

namespace truebox {
namespace {
constexpr double kClosed = 1e-2;  // of a row: sliver elements at contacts are off by this much
}

FormFactors noise_free_form_factors(const PatchMesh& mesh, const Scene& scene,
                                    const FormFactorOptions& options) {
  require_memory(mesh.size(), options);
  ExactFormFactorOptions exact;
  exact.relative_tolerance = std::max(options.relative_tolerance, 1e-5);
  exact.occlusion = options.occlusion;
  auto found = exact_form_factors<double>(mesh, scene, exact, options.memory_limit_bytes);
  FormFactors result;
  result.exchange_area_m2 = std::move(found.exchange_area_m2);
  result.area_m2 = std::move(found.area_m2);
  result.usable = std::move(found.usable);
  FormFactorSummary& summary = result.summary;
  summary.pairs_unoccluded = found.pairs_unoccluded;
  summary.pairs_hidden = found.pairs_hidden;
  summary.pairs_sampled = found.pairs_partial;
  double weighted = 0.0, area = 0.0;
  for (Eigen::Index i = 0; i < result.size(); ++i) {
    if (!result.usable[static_cast<std::size_t>(i)]) {
      result.exchange_area_m2.row(i).setZero();
      result.exchange_area_m2.col(i).setZero();
      ++summary.buried_patches;
      continue;
    }
    const double sum = result.exchange_area_m2.col(i).sum() / result.area_m2[i];
    summary.row_sum_max = std::max(summary.row_sum_max, sum);
    if (scene.surfaces[mesh.surface_of(mesh.patches[static_cast<std::size_t>(i)])].is_opening)
      continue;
    summary.closure_error_max = std::max(summary.closure_error_max, std::abs(sum - 1.0));
    weighted += result.area_m2[i] * std::abs(sum - 1.0);
    area += result.area_m2[i];
  }
  summary.closure_error_mean = area > 0.0 ? weighted / area : 0.0;
  summary.closed = summary.closure_error_max < kClosed;
  summary.closure_residual_max = summary.closure_error_max;
  return result;
}

}  // namespace truebox

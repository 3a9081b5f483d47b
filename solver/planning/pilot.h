// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "adaptive/goal.h"
#include "radiometry/progress.h"
#include "transport/prediction.h"

namespace truebox {

/// A small solve that foretells a large one: what it found and what it cost.
struct Pilot {
  std::size_t elements = 0;
  double relative_bound = 0.0;     ///< largest of a surface's mean irradiance, as a share
  double processor_s = 0.0;        ///< all threads, three grids
  double cost_exponent = 2.0;      ///< processor time ~ elements^this, from a still smaller solve
  double indirect_share = 0.0;     ///< of all irradiance, area-weighted, worst band
  double form_factor_error = 0.0;  ///< of the mean irradiance: two samplings of the middle grid
  FormFactorSummary form_factors;
  double matrix_passes = 0.0;
  int bands_reduced = 0;  ///< found on the basis of the others

  /// Elements that meet a bound by the order that the bound is observed to fall with (n^-3/4).
  double elements_for(double bound) const;
  /// The bound that so many elements should reach, by the same law.
  double bound_for(double wanted_elements) const;
  /// Processor time with so many elements, s: good to a factor of two or so.
  double processor_s_for(double wanted_elements) const;
};

/// How the pilot is solved; form factors and the rest as `options` say.
Pilot fly_pilot(const Scene& scene, const PredictOptions& options,
                const std::optional<Goal>& adapted_to);

/// The same for path tracing: the relative standard error of a pixel, median of a small picture.
struct PathPilot {
  int paths = 0;  ///< a pixel
  int pixels = 0;
  double standard_error = 0.0;  ///< share of the radiance
  double processor_s = 0.0;

  double paths_for(double wanted_standard_error) const;
};
PathPilot fly_path_pilot(const Scene& scene, const CameraDescription& camera);

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "adaptive/goal.h"
#include "radiometry/progress.h"
#include "transport/prediction.h"

namespace truebox {

/// What a requested error is an error of.
enum class ErrorMeasure {
  bound_of_means,  ///< largest bound of a surface's mean irradiance, as a share of that mean
  rms_irradiance   ///< of the field, over the area of all surfaces, as a share of the mean:
                   ///< estimated
};

/// A small solve that foretells a large one: what it found and what it cost.
struct Pilot {
  std::size_t elements = 0;
  ErrorMeasure measure = ErrorMeasure::bound_of_means;
  double relative_bound = 0.0;  ///< bound_of_means
  /// The same if its grids converge as they should: what finer ones are foretold from, see
  /// SurfaceMeans::bound_in_order.
  double bound_in_order = 0.0;
  double field_error = 0.0;     ///< rms_irradiance
  double error_order = 0.75;    ///< the measured error falls like elements^-this
  double processor_s = 0.0;     ///< all threads, three grids
  double cost_exponent = 2.0;   ///< processor time ~ elements^this, from a still smaller solve
  double indirect_share = 0.0;  ///< of all irradiance, area-weighted, worst band
  FormFactorSummary form_factors;
  double matrix_passes = 0.0;
  int bands_reduced = 0;  ///< bands less the most products of a pass

  double error() const;  ///< by the measure
  /// Elements that meet an error by the order that it is observed to fall with.
  double elements_for(double wanted_error) const;
  /// The error that so many elements should reach, by the same law.
  double error_for(double wanted_elements) const;
  /// Processor time with so many elements, s: good to a factor of two or so.
  double processor_s_for(double wanted_elements) const;
};

/// How the pilot is solved; form factors and the rest as `options` say.
Pilot fly_pilot(const Scene& scene, const PredictOptions& options,
                const std::optional<Goal>& adapted_to,
                ErrorMeasure measure = ErrorMeasure::bound_of_means);

/// Elements and processor time alone, from one solve: `cost_exponent` and errors are not found.
Pilot fly_single_pilot(const Scene& scene, const PredictOptions& options);

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

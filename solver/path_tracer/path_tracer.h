// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "image/image.h"
#include "path_tracer/owen_sobol.h"
#include "radiometry/progress.h"
#include "scene/scene.h"

namespace truebox {

struct PathTraceOptions {
  int samples = 256;        ///< paths a pixel, rounded up to a multiple of `randomisations`
  int randomisations = 16;  ///< independent sets of points; the variance comes from these
  std::uint64_t seed = 1;
  Progress progress;
};

/// Mean radiance of each pixel and the variance of that mean, W m^-2 sr^-1 nm^-1 and its square,
/// channels "S0.<nm>nm". The variance has randomisations - 1 degrees of freedom.
struct PathTracedImage {
  Image radiance;
  Image variance;
  int samples = 0;  ///< paths a pixel, as traced
  int randomisations = 0;

  Image standard_error() const;  ///< square root of the variance
};

/// A ray of a pixel for two numbers in (0, 1): origin in m and unit direction; nothing where the
/// camera sees nothing.
struct PixelRay {
  Vec3 origin_m = Vec3::Zero();
  Vec3 direction = Vec3::UnitZ();
};
using RayOfPixel = std::function<std::optional<PixelRay>(int x, int y, UnitPair position)>;

/// Path tracing of the rendering equation in all bands at once: emission + next-event estimation
/// and scattering, weighted by the power heuristic, Russian roulette from the third surface on.
/// Each pixel is the mean over `randomisations` independently scrambled Sobol' sets; their spread
/// is its variance, valid although points within a set are not independent. The same seed gives the
/// same picture, whatever the number of threads. Shares geometry and nothing else with radiosity.
/// What leaves the scene is black. Sources: Kajiya (1986); Veach & Guibas (1995); Owen (1997).
/// std::invalid_argument: fewer than two randomisations, or no samples.
PathTracedImage trace_paths(const Scene& scene, int width_px, int height_px,
                            const RayOfPixel& ray_of_pixel, const PathTraceOptions& options);

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "mesh/smooth_field.h"
#include "probe_points.h"
#include "radiometry/progress.h"
#include "scene/scene.h"

namespace truebox::app {

/// Irradiance at places, places x bands, W m^-2 nm^-1, with its standard error (k = 1).
struct IrradianceTable {
  BandMatrix value, standard_error;
  std::string source;  ///< who says so

  /// Root mean square over what is lit of the relative standard error.
  double relative_error() const;
};

/// Places of the scene's Lambertian surfaces that reflect in every band, at random by area or, with
/// a camera, by its pixels. A seed gives the same places on every machine.
std::vector<ProbePoint> random_places(const Scene& scene, std::size_t count, std::uint64_t seed,
                                      const CameraDescription* camera = nullptr);

/// By path tracing, which shares nothing with radiosity but polygons and rays: each place is looked
/// at from close above, E = pi (L - M / pi) / rho. A place that reflects nothing in a band is
/// given an infinite standard error there. `paths` a place, a multiple of 16.
IrradianceTable trace_irradiance(const Scene& scene, const std::vector<ProbePoint>& places,
                                 int paths, std::uint64_t seed, const Progress& progress = {});

/// Doubles the paths from `least_paths` a place on until `relative_error` is reached, or
/// `most_paths`, or the next round would end beyond `patience_s` of processor time: the source says
/// so, and how good the table is then.
IrradianceTable trace_reference(const Scene& scene, const std::vector<ProbePoint>& places,
                                double relative_error, int least_paths, int most_paths,
                                double patience_s, std::uint64_t seed, const Progress& progress);

/// CSV with name,band_nm,irradiance,standard_error of every place in every band of the scene (rows
/// of other bands are left alone). InputError names what is missing.
IrradianceTable read_irradiance(const std::string& path, const std::vector<ProbePoint>& places,
                                const WavelengthGrid& bands);
std::string irradiance_csv(const IrradianceTable& table, const std::vector<ProbePoint>& places,
                           const Scene& scene);

/// The centres of the bands of such a file, nm.
std::vector<double> bands_of_irradiance(const std::string& path);

}  // namespace truebox::app

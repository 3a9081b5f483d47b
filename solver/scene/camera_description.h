// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "image/bayer.h"
#include "radiometry/tabulated_spectrum.h"
#include "scene/polygon.h"

namespace truebox {

/// Coefficients of OpenCV's lens model, dimensionless, in OpenCV's own order. Its principal point
/// differs from ours by half a pixel: its pixel centres are whole numbers.
/// T is double, or the number type of an optimiser.
template <class T>
struct LensDistortionOf {
  T k1{}, k2{};              ///< radial
  T p1{}, p2{};              ///< tangential
  T k3{}, k4{}, k5{}, k6{};  ///< radial; k4 to k6 in the denominator
  T s1{}, s2{}, s3{}, s4{};  ///< thin prism
};
using LensDistortion = LensDistortionOf<double>;

/// What a lens does to a picture; every member's default leaves it a pinhole.
struct LensDescription {
  LensDistortion distortion;
  std::array<double, 2> principal_point_m = {0.0, 0.0};  ///< right and down of the film's centre
  std::optional<double> f_number;                        ///< a sensor needs one
  bool cos4 = false;                          ///< natural vignetting, cos^4 of the field angle
  std::vector<double> vignetting_polynomial;  ///< a1, a2, ... of 1 + a1 r^2 + a2 r^4 + ...; r is
                                              ///< the image height over the focal length
  double point_spread_m = 0.0;                ///< Gaussian standard deviation on the film
  double veiling_glare = 0.0;  ///< share of the light that is spread evenly, [0, 1) (ISO 9358)
  std::vector<TabulatedSpectrum> transmittances;  ///< of filters and glass, 1

  /// The vignetting polynomial at image height r over focal length.
  double vignetting_at(double r) const {
    double sum = 0.0;
    for (auto a = vignetting_polynomial.rbegin(); a != vignetting_polynomial.rend(); ++a)
      sum = (sum + *a) * r * r;
    return 1.0 + sum;
  }
};

/// One kind of photosite: its colour filter and silicon together.
struct SensorChannel {
  std::string name;                      ///< "R", "G", "B"; "Y" if there is only one
  TabulatedSpectrum quantum_efficiency;  ///< electrons a photon, 1
};

/// An image sensor in the terms of EMVA 1288 and of a measurement's instrument: DN are the camera's
/// digital numbers.
struct SensorDescription {
  std::vector<SensorChannel> channels;
  std::optional<BayerPattern> bayer;  ///< without it, every pixel records every channel
  double exposure_s = 0.0;
  double gain_dn = 1.0;        ///< DN per electron
  double offset_dn = 0.0;      ///< black level: the mean reading without light
  double read_noise_dn = 0.0;  ///< standard deviation, quantisation excluded
  double dark_current_electrons_per_s = 0.0;
  double full_well_electrons = std::numeric_limits<double>::infinity();
  int bits = 0;            ///< of the converter, 0: neither rounds nor clips
  bool shot_noise = true;  ///< of light and dark current
};

/// A camera as a scene file gives it; lengths in m.
struct CameraDescription {
  Vec3 position_m = Vec3::Zero();
  Vec3 direction = Vec3::UnitZ();
  Vec3 up = Vec3::UnitY();
  double focal_length_m = 0.035;
  std::array<double, 2> film_m = {0.025, 0.025};
  std::array<int, 2> pixels = {512, 512};
  LensDescription lens = {};
  std::optional<SensorDescription> sensor = {};

  std::array<double, 2> pixel_pitch_m() const {
    return {film_m[0] / pixels[0], film_m[1] / pixels[1]};
  }
};

}  // namespace truebox

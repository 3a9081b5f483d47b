// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sensor/camera.h"
#include "sensor/point_spread.h"

namespace truebox {

/// What falls on the sensor: photo-electrons a second of every pixel, one plane a channel, before
/// any colour filter mosaic. Noise-free.
struct PhotoCurrent {
  std::vector<std::string> channels;
  std::vector<LightPlane> electrons_per_s;
};

/// From spectral radiance (channels "S0.<nm>nm", W m^-2 sr^-1 nm^-1, seen through the same camera)
/// to photo-electrons a second:
///
///   Q = pi / (4 N^2) A_pixel v  sum_b w_b L_b,     v = cos^4(theta) (1 + a1 r^2 + a2 r^4 + ...)
///
/// N f-number (lens focused far away, aplanatic), theta the ray's angle to the axis before the
/// lens, r = image height / focal length, w_b of `band_responsivity`; then point spread and veiling
/// glare. A stage left at its default does nothing.
/// InputError: no sensor or f-number, bands other than `bands`, or a radiance that is negative or
/// not finite; the message names the pixel.
/// Source: Smith (2008), Modern Optical Engineering, 4th ed., 9.11 (camera equation, cos^4).
PhotoCurrent photo_current(const Image& radiance, const WavelengthGrid& bands,
                           const TabulatedSpectrum& lamp, const CameraDescription& camera);

/// A simulated reading with its truth beside it; all in digital numbers (DN). One channel "Y" with
/// a mosaic or a single channel, otherwise one plane a channel.
struct SensorImage {
  Image reading;  ///< DN; whole numbers if the sensor has bits
  Image
      expected;  ///< offset + gain (photo-electrons + dark electrons), neither clipped nor rounded
  Image variance;  ///< of an unclipped reading about `expected`, DN^2
  Image clipped;   ///< 1 at full well or the top code: `reading` is a bound; -1 below digital zero
  std::size_t saturated = 0, below_zero = 0;  ///< how many samples
};

/// Exposes and reads out:
///
///   electrons = min(Poisson(t (Q + dark)), full well)
///   reading   = round(offset + gain electrons + Normal(0, read noise)),  0 ... 2^bits - 1
///   variance  = gain^2 t (Q + dark) + read noise^2 + 1/12
///
/// 1/12 DN^2 is the variance of rounding if the noise before it is above about half a DN; below,
/// rounding is an error that repeats instead (Widrow, Kollar 2008). Means above 1e9 electrons are
/// drawn from a normal distribution (skewness below 4e-5). Every photosite has its own random
/// numbers, from seed, channel and position: the result does not depend on threads.
/// InputError: an expected reading beyond what a float holds.
/// Source: EMVA Standard 1288 (2021), sections 2.2 to 2.6.
SensorImage read_out(const PhotoCurrent& current, const SensorDescription& sensor,
                     std::uint64_t seed);

/// The exposure time at which the brightest photosite is expected to reach `share` of saturation
/// (the lower of top code and full well). InputError if nothing saturates or everything is dark.
double exposure_reaching(double share, const PhotoCurrent& current,
                         const SensorDescription& sensor);

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "sensor/exposure.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "image/spectral_image.h"
#include "radiometry/input_error.h"
#include "sensor/spectral_responsivity.h"

namespace truebox {
namespace {

constexpr double kQuantisationVariance_dn2 = 1.0 / 12.0;  // of a uniform distribution 1 DN wide
constexpr double kLargestPoissonMean = 1e9;

// SplitMix64 (Steele, Lea, Flood 2014): a few bytes of state, so that each photosite has its own.
class PhotositeRandom {
 public:
  using result_type = std::uint64_t;
  PhotositeRandom(std::uint64_t seed, std::uint64_t channel, std::uint64_t index)
      : state_(mixed(mixed(mixed(seed) + channel) + index)) {}
  static constexpr result_type min() { return 0; }
  static constexpr result_type max() { return std::numeric_limits<result_type>::max(); }
  result_type operator()() { return mixed(state_ += 0x9e3779b97f4a7c15u); }

 private:
  static std::uint64_t mixed(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  std::uint64_t state_;
};

double poisson(double mean, PhotositeRandom& random) {
  if (mean <= 0.0) return 0.0;
  if (mean > kLargestPoissonMean)
    return std::round(std::normal_distribution<double>(mean, std::sqrt(mean))(random));
  return static_cast<double>(std::poisson_distribution<long long>(mean)(random));
}

double top_code_dn(const SensorDescription& sensor) {
  return sensor.bits > 0 ? std::ldexp(1.0, sensor.bits) - 1.0
                         : std::numeric_limits<double>::infinity();
}

void check_radiance(const Image& radiance, const SpectralChannels& bands) {
  const auto source = radiance.attributes.find("source");
  for (std::size_t channel : bands.indices)
    for (std::size_t i = 0; i < radiance.pixel_count(); ++i) {
      const float value = radiance.channels[channel].samples[i];
      if (std::isfinite(value) && value >= 0.0f) continue;
      const auto width = static_cast<std::size_t>(radiance.width);
      throw InputError(source == radiance.attributes.end() ? "radiance image" : source->second, 0,
                       "a finite radiance >= 0 in every pixel",
                       std::to_string(value) + " in channel " + radiance.channels[channel].name +
                           " at pixel (" + std::to_string(i % width) + ", " +
                           std::to_string(i / width) + ")");
    }
}

// Vignetting of every pixel: at its centre, where no light arrives 0.
std::vector<double> relative_illumination(const CameraDescription& description) {
  const Camera camera(description);
  const Vec3 axis = description.direction.normalized();
  std::vector<double> shares;
  for (int y = 0; y < camera.height_px(); ++y)
    for (int x = 0; x < camera.width_px(); ++x) {
      const PixelPosition centre{x + 0.5, y + 0.5};
      const NormalisedPoint image = camera.normalised(centre);
      double share = description.lens.vignetting_at(std::hypot(image.x, image.y));
      if (description.lens.cos4) {
        const auto ray = camera.ray(centre);
        const double cosine = ray ? ray->direction.dot(axis) : 0.0;
        share *= cosine * cosine * cosine * cosine;
      }
      shares.push_back(share);
    }
  return shares;
}

// Which of the channels the photosites of one output plane belong to.
std::size_t channel_at(const SensorDescription& sensor, std::size_t plane, int x, int y) {
  if (!sensor.bayer) return plane;
  const char site = sensor.bayer->site(x, y);
  return site == 'R' ? 0 : site == 'G' ? 1 : 2;  // in the order a description has them
}

void check_mosaic(const SensorDescription& sensor, const std::vector<std::string>& channels) {
  if (sensor.bayer && channels != std::vector<std::string>{"R", "G", "B"})
    throw InputError("sensor", 0, "channels R, G, B, in this order, under a Bayer mosaic",
                     std::to_string(channels.size()) + " channels");
}

}  // namespace

PhotoCurrent photo_current(const Image& radiance, const WavelengthGrid& bands,
                           const TabulatedSpectrum& lamp, const CameraDescription& camera) {
  const LensDescription& lens = camera.lens;
  if (!camera.sensor || camera.sensor->channels.empty() || !lens.f_number)
    throw InputError("camera", 0, "a sensor with a channel and a lens with an f_number",
                     camera.sensor ? "no f_number or channel" : "no sensor");
  const SpectralChannels planes = spectral_channels(radiance);
  if (planes.indices.size() != bands.size() || radiance.width != camera.pixels[0] ||
      radiance.height != camera.pixels[1])
    throw InputError("radiance image", 0, "the camera's pixels and the scene's bands", "others");
  check_radiance(radiance, planes);
  const auto pitch_m = camera.pixel_pitch_m();
  const double etendue_m2sr =
      std::numbers::pi / (4.0 * *lens.f_number * *lens.f_number) * pitch_m[0] * pitch_m[1];
  const std::vector<double> shares = relative_illumination(camera);
  PhotoCurrent current;
  for (const SensorChannel& channel : camera.sensor->channels) {
    std::vector<TabulatedSpectrum> factors = lens.transmittances;
    factors.push_back(channel.quantum_efficiency);
    const std::vector<double> weights = band_responsivity(factors, bands, lamp);
    LightPlane plane{radiance.width, radiance.height, std::vector<double>(radiance.pixel_count())};
    for (std::size_t b = 0; b < weights.size(); ++b) {
      const auto& samples = radiance.channels[planes.indices[b]].samples;
      for (std::size_t i = 0; i < plane.values.size(); ++i)
        plane.values[i] += weights[b] * samples[i];
    }
    for (std::size_t i = 0; i < plane.values.size(); ++i)
      plane.values[i] *= etendue_m2sr * shares[i];
    spread(plane, {lens.point_spread_m / pitch_m[0], lens.point_spread_m / pitch_m[1]});
    add_veiling_glare(plane, lens.veiling_glare);
    current.channels.push_back(channel.name);
    current.electrons_per_s.push_back(std::move(plane));
  }
  return current;
}

SensorImage read_out(const PhotoCurrent& current, const SensorDescription& sensor,
                     std::uint64_t seed) {
  check_mosaic(sensor, current.channels);
  const LightPlane& first = current.electrons_per_s.at(0);
  SensorImage result;
  for (Image* image : {&result.reading, &result.expected, &result.variance, &result.clipped}) {
    *image = Image(first.width, first.height);
    if (sensor.bayer)
      image->add_channel("Y");
    else
      for (const std::string& name : current.channels) image->add_channel(name);
    image->attributes["unit"] = image == &result.variance  ? "DN^2"
                                : image == &result.clipped ? "1"
                                                           : "DN";
  }
  const double top_dn = top_code_dn(sensor), gain = sensor.gain_dn;
  const double fixed_variance = sensor.read_noise_dn * sensor.read_noise_dn +
                                (sensor.bits > 0 ? kQuantisationVariance_dn2 : 0.0);
  std::atomic<std::size_t> saturated{0}, below_zero{0};
  std::atomic<bool> too_large{false};
  for (std::size_t plane = 0; plane < result.reading.channels.size(); ++plane) {
    tbb::parallel_for(tbb::blocked_range<int>(0, first.height), [&](const auto& rows) {
      std::size_t high = 0, low = 0;
      for (int y = rows.begin(); y < rows.end(); ++y)
        for (int x = 0; x < first.width; ++x) {
          const std::size_t i = result.reading.index(x, y);
          const auto& light = current.electrons_per_s[channel_at(sensor, plane, x, y)];
          const double mean =
              sensor.exposure_s * (light.values[i] + sensor.dark_current_electrons_per_s);
          PhotositeRandom random(seed, plane, i);
          double electrons = sensor.shot_noise ? poisson(mean, random) : mean;
          bool full = electrons >= sensor.full_well_electrons;
          if (full) electrons = sensor.full_well_electrons;
          double reading = sensor.offset_dn + gain * electrons;
          if (sensor.read_noise_dn > 0.0)
            reading += std::normal_distribution<double>(0.0, sensor.read_noise_dn)(random);
          bool empty = false;
          if (sensor.bits > 0) {
            reading = std::floor(reading + 0.5);
            full |= reading >= top_dn;
            empty = reading < 0.0;
            reading = std::clamp(reading, 0.0, top_dn);
          }
          high += full;
          low += empty;
          const double expected = sensor.offset_dn + gain * mean;
          const double variance = (sensor.shot_noise ? gain * gain * mean : 0.0) + fixed_variance;
          if (!(std::max(expected, variance) < std::numeric_limits<float>::max())) too_large = true;
          result.reading.channels[plane].samples[i] = static_cast<float>(reading);
          result.expected.channels[plane].samples[i] = static_cast<float>(expected);
          result.variance.channels[plane].samples[i] = static_cast<float>(variance);
          result.clipped.channels[plane].samples[i] = full ? 1.0f : empty ? -1.0f : 0.0f;
        }
      saturated += high;
      below_zero += low;
    });
  }
  if (too_large)
    throw InputError("sensor", 0,
                     "exposure and gain whose expected reading and variance are below "
                     "3.4e38 DN, DN^2",
                     "more");
  result.saturated = saturated;
  result.below_zero = below_zero;
  return result;
}

double exposure_reaching(double share, const PhotoCurrent& current,
                         const SensorDescription& sensor) {
  check_mosaic(sensor, current.channels);
  const double limit_dn =
      std::min(top_code_dn(sensor), sensor.offset_dn + sensor.gain_dn * sensor.full_well_electrons);
  double brightest = 0.0;
  for (const LightPlane& plane : current.electrons_per_s)
    for (double value : plane.values) brightest = std::max(brightest, value);
  const double rate_dn = sensor.gain_dn * (brightest + sensor.dark_current_electrons_per_s);
  if (!std::isfinite(limit_dn) || !(limit_dn > sensor.offset_dn))
    throw InputError("sensor", 0, "bits or full_well_electrons, so that something saturates",
                     "neither above the offset");
  if (!(rate_dn > 0.0)) throw InputError("sensor", 0, "light on the sensor", "none");
  return share * (limit_dn - sensor.offset_dn) / rate_dn;
}

}  // namespace truebox

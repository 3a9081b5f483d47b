// SPDX-License-Identifier: BSD-3-Clause
// Error against time for a picture: radiosity with exact direct light, and path tracing.
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <random>

#include "benchmark.h"
#include "path_tracer/path_tracer.h"
#include "sensor/render.h"

namespace truebox::benchmark {
namespace {

constexpr int kSide_px = 512;
constexpr int kPixels = 500;             // picked at random; the truth of all would take hours
constexpr double kTruthNoise = 2.5e-3;   // one standard error of a pixel and band
constexpr int kFirstSamples = 16384;     // tell how many a pixel needs
constexpr int kMostSamples = 8'388'608;  // dark corners

Camera camera_of(const Scene& scene, int side_px) {
  CameraDescription description = scene.cameras.at("front");
  description.pixels = {side_px, side_px};
  return Camera(description);
}

PathTracedImage trace(const Scene& scene, const std::vector<int>& pixels, int samples,
                      std::uint64_t seed) {
  const Camera camera = camera_of(scene, kSide_px);
  PathTraceOptions options;
  options.samples = samples;
  options.seed = seed;
  return trace_paths(
      scene, static_cast<int>(pixels.size()), 1,
      [&](int k, int, UnitPair at) {
        const int pixel = pixels[static_cast<std::size_t>(k)];
        const Ray ray = *camera.ray({pixel % kSide_px + at.u, pixel / kSide_px + at.v});
        return PixelRay{ray.origin_m, ray.direction};
      },
      options);
}

// Quantiles of |value - truth| / truth over pixels and lit bands.
void quantiles(const std::vector<double>& errors, PictureError& result) {
  std::vector<double> sorted = errors;
  std::sort(sorted.begin(), sorted.end());
  const auto at = [&](double q) {
    return sorted[static_cast<std::size_t>(q * static_cast<double>(sorted.size() - 1))];
  };
  result.median = at(0.5);
  result.p99 = at(0.99);
}

// Bright pixels are known after thousands of paths, dark corners after millions: each takes what it
// needs. Later paths have a seed of their own, or pixels that looked quiet by chance would stay so.
PathTracedImage trace_truth(const Scene& scene, const std::vector<int>& pixels) {
  PathTracedImage truth = trace(scene, pixels, kFirstSamples, 1000);
  std::map<int, std::vector<std::size_t>> needing;
  for (std::size_t k = 0; k < pixels.size(); ++k) {
    double noise = 0.0;
    for (std::size_t c = 0; c < truth.radiance.channels.size(); ++c)
      if (const double value = truth.radiance.channels[c].samples[k]; value > 0.0)
        noise = std::max(noise, std::sqrt(truth.variance.channels[c].samples[k]) / value);
    int samples = kFirstSamples;
    const double needed = kFirstSamples * std::pow(noise / kTruthNoise, 2);
    while (samples < needed && samples < kMostSamples) samples *= 2;
    if (samples > kFirstSamples) needing[samples].push_back(k);
  }
  for (const auto& [samples, which] : needing) {
    std::vector<int> some;
    for (std::size_t k : which) some.push_back(pixels[k]);
    const PathTracedImage traced = trace(scene, some, samples, 2000);
    for (std::size_t c = 0; c < truth.radiance.channels.size(); ++c)
      for (std::size_t i = 0; i < which.size(); ++i) {
        truth.radiance.channels[c].samples[which[i]] = traced.radiance.channels[c].samples[i];
        truth.variance.channels[c].samples[which[i]] = traced.variance.channels[c].samples[i];
      }
  }
  return truth;
}

template <class Value>
std::vector<double> relative_errors(const Image& truth, const Value& value) {
  std::vector<double> errors;
  for (std::size_t c = 0; c < truth.channels.size(); ++c)
    for (std::size_t k = 0; k < truth.channels[c].samples.size(); ++k)
      if (const double t = truth.channels[c].samples[k]; t > 0.0)
        errors.push_back(std::abs(value(c, k) - t) / t);
  return errors;
}

}  // namespace

PictureBenchmark measure_pictures(const Scene& scene, const std::vector<std::size_t>& elements,
                                  const std::vector<int>& samples) {
  std::mt19937_64 random(5);
  std::uniform_int_distribution<int> any(0, kSide_px * kSide_px - 1);
  std::vector<int> pixels(kPixels);
  for (int& pixel : pixels) pixel = any(random);
  PictureBenchmark result;
  const PathTracedImage truth = trace_truth(scene, pixels);
  result.truth_noise.name = "truth's own noise";
  quantiles(relative_errors(truth.radiance,
                            [&](std::size_t c, std::size_t k) {
                              return truth.radiance.channels[c].samples[k] +
                                     std::sqrt(truth.variance.channels[c].samples[k]);
                            }),
            result.truth_noise);
  const double whole = double(kSide_px) * kSide_px / kPixels;
  for (int count : samples) {
    PictureError row{"paths", count};
    PathTracedImage image;
    row.processor_s = whole * processor_seconds([&] { image = trace(scene, pixels, count, 1); });
    quantiles(relative_errors(truth.radiance,
                              [&](std::size_t c, std::size_t k) {
                                return image.radiance.channels[c].samples[k];
                              }),
              row);
    result.rows.push_back(row);
  }
  const auto add_radiosity = [&](std::size_t count, bool gathered) {
    PictureError row{gathered ? "radiosity, edges" : "radiosity", static_cast<int>(count)};
    RenderedImage image;
    std::unique_ptr<Prediction> prediction;
    row.solve_s = processor_seconds([&] {
      PredictOptions options;
      options.elements = count;
      options.gathered_up_to = gathered ? 20000 : 0;
      prediction = std::make_unique<Prediction>(scene, options);
    });
    row.processor_s = row.solve_s + processor_seconds([&] {
                        image = render(*prediction, camera_of(scene, kSide_px), {});
                      });
    quantiles(relative_errors(
                  truth.radiance,
                  [&](std::size_t c, std::size_t k) {
                    return image.radiance.channels[c].samples[static_cast<std::size_t>(pixels[k])];
                  }),
              row);
    result.rows.push_back(row);
  };
  for (const bool gathered : {false, true})
    for (std::size_t count : elements) add_radiosity(count, gathered);
  return result;
}

}  // namespace truebox::benchmark

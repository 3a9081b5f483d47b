// SPDX-License-Identifier: BSD-3-Clause
#include "path_tracer/path_tracer.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Core>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <numbers>
#include <stdexcept>

#include "image/spectral_image.h"
#include "path_tracer/bsdf.h"
#include "path_tracer/path_scene.h"

namespace truebox {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;

constexpr int kRouletteFrom = 3;        // surfaces; shorter paths carry most of the light
constexpr double kMostSurvival = 0.99;  // lossless glass would hold a path for ever

Eigen::Map<const ArrayXd> exitance_of(const Material& material) {
  return {material.exitance.values.data(), static_cast<Index>(material.exitance.values.size())};
}

// Veach's power heuristic, exponent 2, for a strategy of density a where b could have done it too.
double power_heuristic(double a, double b) { return a * a / (a * a + b * b); }

struct Frame {
  Vec3 x, y, z;
  Frame(const Vec3& tangent, const Vec3& normal)
      : x(tangent), y(normal.cross(tangent)), z(normal) {}
  Vec3 local(const Vec3& v) const { return {v.dot(x), v.dot(y), v.dot(z)}; }
  Vec3 world(const Vec3& v) const { return v.x() * x + v.y() * y + v.z() * z; }
};

// One thread's working memory: a value a band.
struct Bands {
  explicit Bands(Index n) : throughput(n), factor(n), radiance(n), mean(n), sum(n), squares(n) {}
  ArrayXd throughput, factor, radiance, mean, sum, squares;
};

class Tracer {
 public:
  explicit Tracer(const Scene& scene) : scene_(scene) {}

  // Adds the radiance that arrives along one path to bands.radiance.
  void trace(Vec3 origin, Vec3 direction, PathNumbers& numbers, Bands& bands) const {
    bands.throughput.setOnes();
    double density = 0.0;  // of the direction, 1/sr; 0: no lamp was aimed at for it
    double index2 = 1.0;   // n^2 of the medium; throughput shrinks by it without any loss
    int only_band = -1;
    Vec3 from = origin;
    for (int depth = 1;; ++depth) {
      const auto hit = scene_.first_hit(origin, direction);
      if (!hit) return;
      const Material& material = *hit->face->material;
      const bool inside = material.scattering == Scattering::dielectric && !hit->front;
      if (!hit->front && !inside) return;
      add_emission(*hit, from, direction, density, bands);
      const Frame frame(hit->face->tangent, hit->normal);
      const Vec3 outgoing = frame.local(-direction);
      const Bsdf bsdf(material);
      const UnitPair lamp = numbers.next(), choice = numbers.next(), towards = numbers.next();
      if (!bsdf.is_specular()) add_direct(*hit, frame, outgoing, bsdf, lamp, choice.u, bands);
      const auto next = bsdf.sample(outgoing, inside, towards, choice, only_band, bands.factor);
      if (!next) return;
      bands.throughput *= bands.factor;
      index2 *= next->relative_index * next->relative_index;
      if (depth >= kRouletteFrom) {
        // One band that stands for all carries their weight; it is no brighter for it.
        const double stands_for =
            only_band < 0 ? 1.0 : static_cast<double>(bands.throughput.size());
        const double survival =
            std::min(kMostSurvival, index2 * bands.throughput.maxCoeff() / stands_for);
        if (!(numbers.next().u < survival)) return;
        bands.throughput /= survival;
      } else if (!(bands.throughput.maxCoeff() > 0.0)) {
        return;
      }
      from = hit->point;
      direction = frame.world(next->incoming).normalized();
      origin = scene_.lifted(hit->point, next->passed ? Vec3(-hit->normal) : hit->normal);
      density = next->density;
    }
  }

 private:
  static void add_emission(const PathScene::Hit& hit, const Vec3& from, const Vec3& direction,
                           double density, Bands& bands) {
    const Material& material = *hit.face->material;
    if (hit.face->lamp_density_per_m2 == 0.0) return;
    double share = 1.0;
    if (density > 0.0)
      share = power_heuristic(density, hit.face->lamp_density_per_m2 *
                                           (hit.point - from).squaredNorm() /
                                           std::abs(hit.normal.dot(direction)));
    bands.radiance += share / std::numbers::pi * bands.throughput * exitance_of(material);
  }

  void add_direct(const PathScene::Hit& hit, const Frame& frame, const Vec3& outgoing,
                  const Bsdf& bsdf, UnitPair position, double choice, Bands& bands) const {
    const auto lamp = scene_.lamp_point(position, choice);
    if (!lamp || lamp->face == hit.face) return;
    const Vec3 way = lamp->point - hit.point;
    const double distance2 = way.squaredNorm();
    const Vec3 direction = way / std::sqrt(distance2);
    const double facing = -lamp->face->plane.normal.dot(direction);
    const double cos_lamp = lamp->face->two_sided ? std::abs(facing) : facing;
    const Vec3 incoming = frame.local(direction);
    if (!(cos_lamp > 0.0) || !(incoming.z() > 0.0)) return;
    bsdf.evaluate(outgoing, incoming, bands.factor);
    const Vec3 lamp_normal = (facing > 0.0 ? 1.0 : -1.0) * lamp->face->plane.normal;
    if (!scene_.sees(hit.point, hit.normal, lamp->point, lamp_normal)) return;
    const double density = lamp->face->lamp_density_per_m2 * distance2 / cos_lamp;
    const double share = power_heuristic(density, bsdf.density(outgoing, incoming));
    bands.radiance += share / (std::numbers::pi * density) * bands.throughput * bands.factor *
                      exitance_of(*lamp->face->material);
  }

  PathScene scene_;
};

Image spectral_planes(int width, int height, const WavelengthGrid& bands, const char* unit) {
  Image image(width, height);
  for (double nm : bands.centres_nm()) image.add_channel(spectral_channel_name(nm));
  image.attributes["unit"] = unit;
  return image;
}

}  // namespace

Image PathTracedImage::standard_error() const {
  Image image = variance;
  for (Channel& channel : image.channels)
    for (float& v : channel.samples) v = std::sqrt(v);
  image.attributes["unit"] = radiance.attributes.at("unit");
  return image;
}

PathTracedImage trace_paths(const Scene& scene, int width_px, int height_px,
                            const RayOfPixel& ray_of_pixel, const PathTraceOptions& options) {
  if (options.randomisations < 2 || options.samples < 1)
    throw std::invalid_argument("path tracing needs a sample and two randomisations");
  const Tracer tracer(scene);
  const auto sets = options.randomisations;
  const int points = (options.samples + sets - 1) / sets;
  PathTracedImage result{
      spectral_planes(width_px, height_px, scene.bands, "W m^-2 sr^-1 nm^-1"),
      spectral_planes(width_px, height_px, scene.bands, "(W m^-2 sr^-1 nm^-1)^2"), points * sets,
      sets};
  std::atomic<int> rows_done{0};
  std::mutex progress_lock;
  tbb::parallel_for(tbb::blocked_range<int>(0, height_px), [&](const auto& rows) {
    Bands bands(static_cast<Index>(scene.bands.size()));
    for (int y = rows.begin(); y < rows.end(); ++y) {
      for (int x = 0; x < width_px; ++x) {
        const std::size_t pixel = result.radiance.index(x, y);
        const std::uint64_t pixel_seed = mixed(options.seed, pixel);
        bands.sum.setZero();
        bands.squares.setZero();
        for (int set = 0; set < sets; ++set) {
          const std::uint64_t seed = mixed(pixel_seed, static_cast<std::uint64_t>(set));
          bands.radiance.setZero();
          for (int k = 0; k < points; ++k) {
            PathNumbers numbers(seed, static_cast<std::uint32_t>(k));
            const auto ray = ray_of_pixel(x, y, numbers.next());
            if (ray) tracer.trace(ray->origin_m, ray->direction, numbers, bands);
          }
          bands.radiance /= points;
          // Deviations from the first set keep the digits of a small variance.
          if (set == 0) bands.mean = bands.radiance;
          bands.radiance -= bands.mean;
          bands.sum += bands.radiance;
          bands.squares += bands.radiance.square();
        }
        for (std::size_t b = 0; b < scene.bands.size(); ++b) {
          const auto k = static_cast<Index>(b);
          const double shift = bands.sum[k] / sets;
          result.radiance.channels[b].samples[pixel] = static_cast<float>(bands.mean[k] + shift);
          result.variance.channels[b].samples[pixel] = static_cast<float>(
              std::max(0.0, bands.squares[k] / sets - shift * shift) / (sets - 1));
        }
      }
    }
    const int done = rows_done += rows.end() - rows.begin();
    if (options.progress) {
      const std::lock_guard guard(progress_lock);
      options.progress("paths", static_cast<double>(done) / height_px);
    }
  });
  return result;
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "sensor/render.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <numbers>

#include "image/spectral_image.h"

namespace truebox {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr std::uint32_t kNothing = ~0u, kBack = ~0u - 1;

// Sums of one pixel over its points.
struct PixelSum {
  explicit PixelSum(Index bands)
      : sum(VectorXd::Zero(bands)),
        bound(VectorXd::Zero(bands)),
        least(VectorXd::Constant(bands, INFINITY)),
        most(VectorXd::Constant(bands, -INFINITY)) {}
  VectorXd sum, bound, least, most;
  int points = 0;
  std::uint32_t first_seen = kNothing;
  bool mixed = false;

  void clear() { *this = PixelSum(sum.size()); }
};

double radical_inverse(unsigned index) {  // base 2 (van der Corput 1935)
  double value = 0.0, digit = 0.5;
  for (; index; index >>= 1, digit *= 0.5)
    if (index & 1u) value += digit;
  return value;
}

class Renderer {
 public:
  Renderer(const Prediction& prediction, const Camera& camera)
      : prediction_(prediction),
        camera_(camera),
        bands_(static_cast<Index>(prediction.scene().bands.size())) {}

  // Hammersley points: n of them see an edge in any direction to about n^-3/4.
  void add_points(int x, int y, int per_side, PixelSum& pixel, Gather::Scratch& scratch) const {
    const int count = per_side * per_side;
    for (int k = 0; k < count; ++k)
      add_point(
          {x + (k + 0.5) / count, y + radical_inverse(static_cast<unsigned>(k)) + 0.5 / count},
          pixel, scratch);
  }

  // Whether a corner of the pixel sees another surface: a sliver that the points may have missed.
  bool corners_differ(int x, int y, const PixelSum& pixel) const {
    for (int corner = 0; corner < 4; ++corner) {
      if (seen_by(first_hit({x + (corner & 1) + 0.0, y + (corner >> 1) + 0.0})) != pixel.first_seen)
        return true;
    }
    return false;
  }

 private:
  static std::uint32_t seen_by(const std::optional<Visibility::Hit>& hit) {
    return !hit ? kNothing : hit->front ? hit->piece : kBack;
  }

  // Nothing, too, where the lens images no direction.
  std::optional<Visibility::Hit> first_hit(PixelPosition position) const {
    const auto ray = camera_.ray(position);
    if (!ray) return std::nullopt;
    return prediction_.visibility().first_hit(ray->origin_m, ray->direction);
  }

  void add_point(PixelPosition position, PixelSum& pixel, Gather::Scratch& scratch) const {
    const auto hit = first_hit(position);
    const std::uint32_t seen = seen_by(hit);
    if (pixel.points == 0) pixel.first_seen = seen;
    pixel.mixed |= seen != pixel.first_seen;
    ++pixel.points;
    VectorXd radiance = VectorXd::Zero(bands_);
    if (seen != kNothing && seen != kBack) {
      const Scene& scene = prediction_.scene();
      const Material& material =
          scene.material_of(scene.surfaces[prediction_.fine().mesh.pieces[seen].surface]);
      const auto rho = Eigen::Map<const VectorXd>(material.reflectance.values.data(), bands_);
      const auto own = Eigen::Map<const VectorXd>(material.exitance.values.data(), bands_);
      const BoundedIrradiance light = prediction_.irradiance_on(seen, hit->point, scratch);
      radiance = (own + rho.cwiseProduct(light.value)) / std::numbers::pi;
      pixel.bound += rho.cwiseProduct(light.error_bound) / std::numbers::pi;
    }
    pixel.sum += radiance;
    pixel.least = pixel.least.cwiseMin(radiance);
    pixel.most = pixel.most.cwiseMax(radiance);
  }

  const Prediction& prediction_;
  const Camera& camera_;
  Index bands_;
};

Image spectral_planes(const Camera& camera, const WavelengthGrid& bands) {
  Image image(camera.width_px(), camera.height_px());
  for (double nm : bands.centres_nm()) image.add_channel(spectral_channel_name(nm));
  image.attributes["unit"] = "W m^-2 sr^-1 nm^-1";
  return image;
}

}  // namespace

RenderedImage render(const Prediction& prediction, const Camera& camera,
                     const RenderOptions& options) {
  const WavelengthGrid& bands = prediction.scene().bands;
  RenderedImage result{spectral_planes(camera, bands), spectral_planes(camera, bands)};
  const Renderer renderer(prediction, camera);
  std::atomic<int> rows_done{0};
  std::mutex progress_lock;
  tbb::parallel_for(tbb::blocked_range<int>(0, camera.height_px(), 2), [&](const auto& rows) {
    Gather::Scratch scratch;
    PixelSum pixel(static_cast<Index>(bands.size()));
    for (int y = rows.begin(); y < rows.end(); ++y) {
      for (int x = 0; x < camera.width_px(); ++x) {
        pixel.clear();
        renderer.add_points(x, y, options.samples_per_side, pixel, scratch);
        if (pixel.mixed || renderer.corners_differ(x, y, pixel)) {
          pixel.clear();
          renderer.add_points(x, y, options.edge_samples_per_side, pixel, scratch);
          pixel.mixed = true;
        }
        const double rate = std::pow(pixel.points, pixel.mixed ? -0.75 : -1.0);
        const std::size_t index = result.radiance.index(x, y);
        for (std::size_t b = 0; b < bands.size(); ++b) {
          const auto k = static_cast<Index>(b);
          result.radiance.channels[b].samples[index] =
              static_cast<float>(pixel.sum[k] / pixel.points);
          result.error_bound.channels[b].samples[index] = static_cast<float>(
              pixel.bound[k] / pixel.points + rate * (pixel.most[k] - pixel.least[k]));
        }
      }
    }
    const int done = rows_done += rows.end() - rows.begin();
    if (options.progress) {
      const std::lock_guard guard(progress_lock);
      options.progress("render", static_cast<double>(done) / camera.height_px());
    }
  });
  return result;
}

}  // namespace truebox

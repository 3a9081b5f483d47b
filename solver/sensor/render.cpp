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

constexpr double kDark = 1e-300;  // keeps an infinite share of nothing from being not a number

constexpr int kMostShare = 16;  // times `edge_samples` that a pixel takes at most

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

  VectorXd mean() const { return sum / points; }
  VectorXd sampling_bound() const {
    return std::pow(points, mixed ? -0.75 : -1.0) * (most - least);
  }
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
  Renderer(const Prediction& prediction, const Camera& camera, PixelFilter filter)
      : prediction_(prediction),
        camera_(camera),
        filter_(filter),
        bands_(static_cast<Index>(prediction.scene().bands.size())) {}

  void add_points(int x, int y, int count, PixelSum& pixel, Gather::Scratch& scratch) const {
    for (int k = 0; k < count; ++k) add_point(point_of(x, y, k, count), pixel, scratch);
  }

  // Puts what a gather finds at a few points in the place of the smooth field there. What the
  // difference does between those points is added to the bound.
  void gather_again(int x, int y, VectorXd& radiance, VectorXd& bound,
                    Gather::Scratch& scratch) const {
    VectorXd mean = VectorXd::Zero(bands_), own = mean, field = mean;
    VectorXd least = VectorXd::Constant(bands_, INFINITY), most = -least;
    for (int k = 0; k < kGatherPoints; ++k) {
      VectorXd correction = VectorXd::Zero(bands_);
      if (const auto seen = seen_at(point_of(x, y, k, kGatherPoints))) {
        const BoundedIrradiance gathered = prediction_.irradiance_at(seen->point, seen->normal);
        const BoundedIrradiance smooth =
            prediction_.irradiance_on(seen->piece, seen->point, scratch);
        correction = seen->rho.cwiseProduct(gathered.value - smooth.value) / std::numbers::pi;
        own += seen->rho.cwiseProduct(gathered.error_bound) / std::numbers::pi;
        field += seen->rho.cwiseProduct(smooth.error_bound) / std::numbers::pi;
      }
      mean += correction;
      least = least.cwiseMin(correction);
      most = most.cwiseMax(correction);
    }
    mean /= kGatherPoints;
    const VectorXd tighter = bound + (own - field + most - least) / kGatherPoints;
    for (Index b = 0; b < bands_; ++b) {
      if (!(tighter[b] < bound[b])) continue;
      radiance[b] = std::max(0.0, radiance[b] + mean[b]);
      bound[b] = std::max(own[b] / kGatherPoints, tighter[b]);
    }
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
  static constexpr int kGatherPoints = 4;

  // Hammersley points: n of them see an edge in any direction to about n^-3/4.
  PixelPosition point_of(int x, int y, int k, int count) const {
    return {
        x + filtered_position_px(filter_, (k + 0.5) / count),
        y + filtered_position_px(filter_, radical_inverse(static_cast<unsigned>(k)) + 0.5 / count)};
  }

  struct Seen {
    std::uint32_t piece;
    Vec3 point, normal;
    Eigen::Map<const VectorXd> rho;
  };
  std::optional<Seen> seen_at(PixelPosition position) const {
    const auto hit = first_hit(position);
    if (!hit || !hit->front) return std::nullopt;
    const Piece& piece = prediction_.fine().mesh.pieces[hit->piece];
    const Scene& scene = prediction_.scene();
    const auto& rho = scene.material_of(scene.surfaces[piece.surface]).reflectance.values;
    return Seen{hit->piece, hit->point, piece.plane.normal, {rho.data(), bands_}};
  }

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
  PixelFilter filter_;
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
  RenderedImage result{spectral_planes(camera, bands), spectral_planes(camera, bands), 0, 0};
  const Renderer renderer(prediction, camera, options.filter);
  std::atomic<int> rows_done{0};
  std::atomic<std::size_t> edge_pixels{0}, gathered_pixels{0};
  std::mutex progress_lock;
  tbb::parallel_for(tbb::blocked_range<int>(0, camera.height_px(), 2), [&](const auto& rows) {
    Gather::Scratch scratch;
    PixelSum pixel(static_cast<Index>(bands.size()));
    const auto is_uneven = [&](const PixelSum& sum) {
      return (sum.sampling_bound() - options.even_within * sum.mean()).maxCoeff() > 0.0;
    };
    for (int y = rows.begin(); y < rows.end(); ++y) {
      for (int x = 0; x < camera.width_px(); ++x) {
        pixel.clear();
        renderer.add_points(x, y, options.samples, pixel, scratch);
        const bool is_even = !pixel.mixed && !renderer.corners_differ(x, y, pixel);
        if (!is_even || is_uneven(pixel)) {
          // Where the contrast is large, as before a dark background, even those do not suffice.
          for (int points = options.edge_samples; points <= kMostShare * options.edge_samples;
               points *= 4) {
            pixel.clear();
            renderer.add_points(x, y, points, pixel, scratch);
            pixel.mixed |= !is_even;
            if (!is_uneven(pixel)) break;
          }
          ++edge_pixels;
        }
        VectorXd radiance = pixel.mean();
        VectorXd bound = pixel.bound / pixel.points + pixel.sampling_bound();
        if ((bound - options.gather_above * radiance.cwiseMax(kDark)).maxCoeff() > 0.0) {
          renderer.gather_again(x, y, radiance, bound, scratch);
          ++gathered_pixels;
        }
        const std::size_t index = result.radiance.index(x, y);
        for (std::size_t b = 0; b < bands.size(); ++b) {
          const auto k = static_cast<Index>(b);
          result.radiance.channels[b].samples[index] = static_cast<float>(radiance[k]);
          result.error_bound.channels[b].samples[index] = static_cast<float>(bound[k]);
        }
      }
    }
    const int done = rows_done += rows.end() - rows.begin();
    if (options.progress) {
      const std::lock_guard guard(progress_lock);
      options.progress("render", static_cast<double>(done) / camera.height_px());
    }
  });
  result.edge_pixels = edge_pixels;
  result.gathered_pixels = gathered_pixels;
  return result;
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "alignment/radiance_samples.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "alignment/edge_planes.h"
#include "image/spectral_image.h"
#include "radiometry/input_error.h"

namespace truebox {
namespace {

std::vector<std::string> all_light(const Image& image) {
  std::vector<std::string> names;
  for (const std::size_t i : spectral_channels(image).indices)
    names.push_back(image.channels[i].name);
  if (names.empty() && image.find("R") && image.find("G") && image.find("B"))
    names = {"R", "G", "B"};
  if (names.empty())
    for (const Channel& channel : image.channels) names.push_back(channel.name);
  return names;
}

/// Channels of both, band by band; the second of each pair are averaged.
struct Matched {
  std::string name;
  std::vector<std::string> photograph, render;
};
std::vector<Matched> matched_channels(const Image& photograph, const Image& render) {
  std::vector<Matched> matched;
  for (const std::string& name : all_light(photograph))
    if (spectral_channel_wavelength_nm(name) > 0.0 && render.find(name))
      matched.push_back({name, {name}, {name}});
  if (matched.empty() && photograph.find("R") && render.find("R"))
    for (const char* name : {"R", "G", "B"})
      if (photograph.find(name) && render.find(name)) matched.push_back({name, {name}, {name}});
  if (matched.empty()) matched.push_back({"mean", all_light(photograph), all_light(render)});
  return matched;
}

std::vector<float> mean_plane(const Image& image, const std::vector<std::string>& names) {
  std::vector<float> mean(image.pixel_count(), 0.0f);
  for (const std::string& name : names) {
    const auto plane = linear_light(image, *image.find(name));
    for (std::size_t i = 0; i < mean.size(); ++i)
      mean[i] += plane[i] / static_cast<float>(names.size());
  }
  return mean;
}

/// False where there is no light.
bool scale_to_white(std::vector<float>& plane) {
  std::vector<float> sorted;
  for (const float v : plane)
    if (std::isfinite(v)) sorted.push_back(v);
  if (sorted.empty()) return false;
  const auto top = sorted.begin() + static_cast<std::ptrdiff_t>(0.999 * double(sorted.size() - 1));
  std::nth_element(sorted.begin(), top, sorted.end());
  const float white = *top;
  if (!(white > 0.0f)) return false;
  for (float& v : plane) v /= white;
  return true;
}

/// Whether an area shows one surface and nothing else: counted over rows and columns at once.
class OneSurface {
 public:
  explicit OneSurface(const RenderedView& view)
      : width_(view.picture().width), height_(view.picture().height) {
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x) {
        const auto place = view.at_pixel(x, y);
        ids_.push_back(place ? place->surface : 0);
      }
    // Changes of surface between a pixel and its right or lower neighbour, summed from the corner.
    sums_.assign(static_cast<std::size_t>(width_ + 1) * static_cast<std::size_t>(height_ + 1), 0);
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x) {
        const int own = id(x, y);
        const int changes = (x + 1 < width_ && id(x + 1, y) != own) +
                            (y + 1 < height_ && id(x, y + 1) != own) + (own == 0);
        sum(x + 1, y + 1) = changes + sum(x, y + 1) + sum(x + 1, y) - sum(x, y);
      }
  }
  int id(int x, int y) const { return ids_[static_cast<std::size_t>(y * width_ + x)]; }

  /// Within `reach` of a pixel; what lies off the picture counts as another surface.
  bool around(int x, int y, int reach) const {
    const int x0 = x - reach, y0 = y - reach, x1 = x + reach + 1, y1 = y + reach + 1;
    if (x0 < 0 || y0 < 0 || x1 > width_ || y1 > height_) return false;
    return sum(x1, y1) - sum(x0, y1) - sum(x1, y0) + sum(x0, y0) == 0;
  }

 private:
  int& sum(int x, int y) { return sums_[static_cast<std::size_t>(y * (width_ + 1) + x)]; }
  int sum(int x, int y) const { return sums_[static_cast<std::size_t>(y * (width_ + 1) + x)]; }

  int width_, height_;
  std::vector<int> ids_, sums_;
};

bool any_light(const BandPairs& pairs, std::size_t pixel) {
  return std::any_of(pairs.bands.begin(), pairs.bands.end(),
                     [&](const BandPair& band) { return std::isfinite(band.photograph[pixel]); });
}

PixelPosition operator-(PixelPosition a, PixelPosition b) {
  return {a.x_px - b.x_px, a.y_px - b.y_px};
}

}  // namespace

BandPairs paired_bands(const RenderedView& view, const Image& photograph, const Image* mask,
                       int most_px) {
  if (mask && (mask->width != photograph.width || mask->height != photograph.height ||
               mask->channels.empty()))
    throw MismatchError("the mask has another size than the photograph");
  BandPairs pairs;
  while (std::max(photograph.width, photograph.height) > most_px * pairs.reduction)
    ++pairs.reduction;
  pairs.width = photograph.width / pairs.reduction;
  pairs.height = photograph.height / pairs.reduction;
  const double top = saturation_of(photograph);
  for (const Matched& m : matched_channels(photograph, view.picture())) {
    BandPair pair{m.name, mean_plane(photograph, m.photograph),
                  mean_plane(view.picture(), m.render)};
    for (std::size_t i = 0; i < pair.photograph.size(); ++i) {
      bool out = mask && mask->channels[0].samples[i] == 0.0f;
      for (const std::string& name : m.photograph) {
        const float v = photograph.find(name)->samples[i];
        out |= !std::isfinite(v) || v >= top;
      }
      if (out) pair.photograph[i] = std::numeric_limits<float>::quiet_NaN();
    }
    pair.photograph =
        reduced(pair.photograph, photograph.width, photograph.height, pairs.reduction);
    // A band without light, as at the ends of a lamp's spectrum, tells nothing.
    if (scale_to_white(pair.photograph) && scale_to_white(pair.render))
      pairs.bands.push_back(std::move(pair));
  }
  if (pairs.bands.empty())
    throw InputError("align", 0, "a band with light in both pictures, outside the mask", "none");
  return pairs;
}

std::vector<RadianceSample> radiance_samples(const RenderedView& view, const BandPairs& bands,
                                             const CameraParameters& parameters,
                                             const CameraDescription& like, double clearance_px,
                                             std::size_t most) {
  const OneSurface one(view);
  const Camera photo_camera(camera_description(parameters, like));
  const Camera render_camera(view.camera());
  const Vec3 stretch(parameters.stretch[0], parameters.stretch[1], parameters.stretch[2]);
  const double unit = bands.reduction;
  // px of the render for one of the photograph.
  const double size = static_cast<double>(view.picture().width) / like.pixels[0];
  const int reach = static_cast<int>(std::ceil(clearance_px * size)) + 1;
  const auto pixels = static_cast<double>(bands.width) * bands.height;
  const int stride =
      std::max(1, static_cast<int>(std::ceil(std::sqrt(pixels / static_cast<double>(most)))));
  // Which pixel of the render shows what a pixel of the photograph shows: by the nearest one that
  // lands there.
  std::vector<int> shown(static_cast<std::size_t>(bands.width * bands.height), -1);
  for (int y = 0; y < view.picture().height; ++y)
    for (int x = 0; x < view.picture().width; ++x) {
      if (!one.around(x, y, reach)) continue;
      const auto place = view.at_pixel(x, y);
      const auto at = place ? projected(parameters, place->point_m) : std::nullopt;
      if (!at) continue;
      // A render of fewer pixels covers several of the photograph's.
      const int spread = static_cast<int>(std::ceil(0.5 / (size * unit)));
      for (int dy = -spread; dy <= spread; ++dy)
        for (int dx = -spread; dx <= spread; ++dx) {
          const int px = static_cast<int>(std::floor(at->x_px / unit)) + dx;
          const int py = static_cast<int>(std::floor(at->y_px / unit)) + dy;
          if (px < 0 || py < 0 || px >= bands.width || py >= bands.height) continue;
          if (px % stride != 0 || py % stride != 0) continue;
          shown[static_cast<std::size_t>(py * bands.width + px)] = y * view.picture().width + x;
        }
    }
  std::vector<RadianceSample> samples;
  for (int py = 0; py < bands.height; py += stride)
    for (int px = 0; px < bands.width; px += stride) {
      const auto pixel = static_cast<std::size_t>(py * bands.width + px);
      const int from = shown[pixel];
      if (from < 0 || !any_light(bands, pixel)) continue;
      const auto place = *view.at_pixel(from % view.picture().width, from / view.picture().width);
      // The plane as the photographed scene has it.
      const Vec3 point = stretched(parameters, place.point_m);
      const Vec3 normal = place.normal.cwiseQuotient(stretch).normalized();
      const auto world = [&](double x, double y) -> std::optional<Vec3> {
        const auto ray = photo_camera.ray({x, y});
        const auto hit = ray ? ray_meets_plane(*ray, point, normal) : std::nullopt;
        if (!hit) return std::nullopt;
        return parameters.centre_m + (*hit - parameters.centre_m).cwiseQuotient(stretch);
      };
      const auto in_render = [&](double x, double y) -> std::optional<PixelPosition> {
        const auto at = world(x, y);
        if (!at) return std::nullopt;
        const auto projection = render_camera.project(*at);
        if (projection.outcome != LensOutcome::ok) return std::nullopt;
        return projection.position;
      };
      RadianceSample s;
      s.x = px;
      s.y = py;
      s.surface = place.surface;
      s.seen = {(px + 0.5) * unit, (py + 0.5) * unit};
      const auto here = world(s.seen.x_px, s.seen.y_px);
      const auto at = in_render(s.seen.x_px, s.seen.y_px);
      const auto right = in_render(s.seen.x_px + 0.5, s.seen.y_px),
                 left = in_render(s.seen.x_px - 0.5, s.seen.y_px),
                 down = in_render(s.seen.x_px, s.seen.y_px + 0.5),
                 up = in_render(s.seen.x_px, s.seen.y_px - 0.5);
      if (!here || !at || !right || !left || !down || !up) continue;
      s.point_m = *here;
      s.render = *at;
      const PixelPosition across = *right - *left, along = *down - *up;
      s.render_from_photo << across.x_px, along.x_px, across.y_px, along.y_px;
      samples.push_back(s);
    }
  return samples;
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "fit/scene_planes.h"

#include <cmath>
#include <map>
#include <tuple>

#include "fit/scene_choices.h"
#include "image/image_file.h"
#include "image/spectral_image.h"
#include "radiometry/input_error.h"
#include "radiometry/table_file.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr double kSameBand_nm = 0.5;   // channel names are rounded by their writers
constexpr double kUsableShare = 0.75;  // of a block's pixels

/// The image planes of one photograph as they are read, pixel by pixel.
struct PixelPlane {
  const std::vector<float>* value = nullptr;
  const std::vector<float>* variance = nullptr;        // may be null
  const std::vector<float>* standard_error = nullptr;  // may be null
  const std::vector<float>* mask = nullptr;
};

std::string channel_names(const Image& image) {
  std::string text;
  for (const Channel& c : image.channels) text += (text.empty() ? "" : ", ") + c.name;
  return text;
}

const std::vector<float>& channel_of(const Image& image, const std::string& name,
                                     const std::string& file) {
  const Channel* channel = image.find(name);
  if (!channel)
    throw MismatchError(file + ": there is no channel \"" + name + "\"; it has " +
                        channel_names(image));
  return channel->samples;
}

/// The camera with as many pixels as the photograph, where both have the same shape.
CameraDescription camera_for(CameraDescription camera, const Image& image) {
  const auto [width, height] = camera.pixels;
  if (static_cast<std::int64_t>(width) * image.height ==
      static_cast<std::int64_t>(height) * image.width)
    camera.pixels = {image.width, image.height};
  return camera;
}

void require_size(const Image& image, const CameraDescription& camera, const std::string& file) {
  if (image.width == camera.pixels[0] && image.height == camera.pixels[1]) return;
  throw MismatchError(file + " has " + std::to_string(image.width) + " x " +
                      std::to_string(image.height) + " pixels, its camera " +
                      std::to_string(camera.pixels[0]) + " x " + std::to_string(camera.pixels[1]));
}

std::size_t band_at(const Scene& scene, double nm, const std::string& file, int line) {
  for (std::size_t b = 0; b < scene.bands.size(); ++b)
    if (std::abs(scene.bands.centre_nm(b) - nm) <= kSameBand_nm) return b;
  std::string known;
  for (const double c : scene.bands.centres_nm())
    known += (known.empty() ? "" : ", ") + std::to_string(static_cast<int>(std::lround(c)));
  throw InputError(file, line, "a band of the scene (" + known + " nm)", std::to_string(nm));
}

/// Planes by the names of spectral channels, one a band of the scene.
std::vector<PlaneSource> spectral_planes(const Image& image, const Scene& scene,
                                         const std::string& file) {
  const SpectralChannels found = spectral_channels(image);
  std::vector<PlaneSource> planes;
  for (std::size_t b = 0; b < scene.bands.size(); ++b) {
    const double nm = scene.bands.centre_nm(b);
    for (std::size_t k = 0; k < found.indices.size(); ++k)
      if (std::abs(found.wavelengths_nm[k] - nm) <= kSameBand_nm) {
        PlaneSource plane;
        plane.channel = image.channels[found.indices[k]].name;
        plane.name = std::to_string(static_cast<int>(std::lround(nm))) + " nm";
        plane.band_nm = nm;
        planes.push_back(std::move(plane));
      }
  }
  if (planes.size() != scene.bands.size())
    throw MismatchError(file + ": spectral channels for each of the scene's " +
                        std::to_string(scene.bands.size()) + " bands are needed, it has " +
                        channel_names(image) + "; or name [[photographs.planes]]");
  return planes;
}

Eigen::VectorXd weights_of(const PlaneSource& plane, const Scene& scene, const std::string& file) {
  const auto bands = static_cast<Index>(scene.bands.size());
  if (plane.band_nm)
    return Eigen::VectorXd::Unit(
        bands, static_cast<Index>(band_at(scene, *plane.band_nm, file, plane.line)));
  const TabulatedSpectrum curve =
      spectrum_from_table(read_table(plane.responsivity_path), plane.responsivity_column);
  Eigen::VectorXd weights(bands);
  double sum = 0.0;
  for (Index b = 0; b < bands; ++b) {
    const auto band = static_cast<std::size_t>(b);
    const double nm = scene.bands.centre_nm(band), width = scene.bands.width_nm(band);
    // Beyond its table a responsivity is unknown, and small wherever tables are cut: 0.
    weights[b] = curve.covers(nm, nm) ? width * curve.band_mean(nm, width) : 0.0;
    sum += weights[b];
  }
  if (!(sum > 0.0))
    throw InputError(plane.responsivity_path, 0, "a responsivity in the scene's bands", "none");
  return weights / sum;
}

/// A well-mixed number in [0, 1) from a block's number (splitmix64, Steele et al. 2014).
double lot(std::uint64_t n) {
  n += 0x9e3779b97f4a7c15ull;
  n = (n ^ (n >> 30)) * 0xbf58476d1ce4e5b9ull;
  n = (n ^ (n >> 27)) * 0x94d049bb133111ebull;
  return static_cast<double>((n ^ (n >> 31)) >> 11) * 0x1.0p-53;
}

struct BlockSum {
  double value = 0.0, variance = 0.0;
  std::size_t used = 0, saturated = 0;
};

BlockSum sum_pixels(const ViewBlock& block, const PixelPlane& plane, const PhotographSource& photo,
                    PlaneCounts& counts) {
  BlockSum sum;
  for (const std::uint32_t i : block.pixels) {
    const double raw = (*plane.value)[i], value = photo.scale * raw;
    const double error = plane.standard_error ? (*plane.standard_error)[i] : 0.0;
    const double variance = (plane.variance ? (*plane.variance)[i] : 0.0) + error * error;
    if (plane.mask && !((*plane.mask)[i] > 0.0f)) {
      ++counts.masked;
    } else if (!std::isfinite(value) || !std::isfinite(variance) || variance < 0.0) {
      ++counts.not_finite;
    } else if (photo.saturation > 0.0 && raw >= photo.saturation) {
      ++counts.saturated;
      ++sum.saturated;
    } else {
      sum.value += value;
      sum.variance += photo.scale * photo.scale * variance + std::pow(photo.relative_u * value, 2) +
                      std::pow(photo.scale * photo.absolute_u, 2);
      ++sum.used;
    }
  }
  return sum;
}

void add_readings(SceneMeasurement& m, const PhotographSource& photo, std::size_t view,
                  const PixelPlane& pixels, PlaneReadings& plane, PlaneCounts& counts) {
  std::vector<BlockReading> held_out;
  const auto& blocks = m.model().blocks();
  std::size_t in_blocks = 0;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (blocks[i].view != view || blocks[i].parts.empty()) continue;
    const auto weight = m.file.surface_weights.find(m.scene().surfaces[blocks[i].surface].name);
    const double w = weight == m.file.surface_weights.end() ? 1.0 : weight->second;
    if (!(w > 0.0)) continue;
    in_blocks += blocks[i].pixels.size();
    const BlockSum sum = sum_pixels(blocks[i], pixels, photo, counts);
    if (sum.saturated > 0 ||
        static_cast<double>(sum.used) < kUsableShare * static_cast<double>(blocks[i].pixels.size()))
      continue;
    const double n = static_cast<double>(sum.used), value = sum.value / n;
    const double own = (blocks[i].is_mixed ? std::max(photo.edge_relative_u, photo.block_relative_u)
                                           : photo.block_relative_u) *
                       value;
    const double sampling = blocks[i].sampling_u() * value;
    const double u = std::sqrt((sum.variance / (n * n) + own * own + sampling * sampling) / w);
    if (!(u > 0.0)) continue;
    const bool hold = lot(i) < m.file.held_out_share;
    (hold ? held_out : plane.readings).push_back({i, value, u});
    (hold ? counts.held_out : counts.used) += sum.used;
  }
  counts.not_shown = counts.pixels - in_blocks;
  m.held_out.push_back(std::move(held_out));
}

}  // namespace

namespace {

/// Views are shared by the planes of one camera, size and colour of photosites.
class Views {
 public:
  explicit Views(SceneMeasurement& m) : m_(m) {
    m.shaped.model->clear_views();
    m.shaped.views.clear();
  }

  std::size_t of(const PhotographSource& photo, const CameraDescription& camera, char photosites) {
    const auto key = std::make_tuple(photo.camera, camera.pixels[0], camera.pixels[1], photosites,
                                     photosites ? photo.bayer->name() : std::string());
    if (const auto known = known_.find(key); known != known_.end()) return known->second;
    m_.shaped.views.push_back({photo.camera, camera.pixels});
    std::function<bool(int, int)> uses;
    if (photosites)
      uses = [pattern = *photo.bayer, photosites](int x, int y) {
        return pattern.site(x, y) == photosites;
      };
    const std::size_t view = m_.shaped.views.size() - 1;
    return known_[key] = m_.shaped.model->add_view(m_.shaped.camera(m_.shaped.values, view), uses);
  }

 private:
  SceneMeasurement& m_;
  std::map<std::tuple<std::string, int, int, char, std::string>, std::size_t> known_;
};

}  // namespace

void add_planes(SceneMeasurement& m, const Progress& progress) {
  m.problem.planes.clear();
  m.held_out.clear();
  m.counts.clear();
  m.size_px.clear();
  Views views(m);
  for (const PhotographSource& photo : m.file.photographs) {
    const auto named = m.scene().cameras.find(photo.camera);
    if (named == m.scene().cameras.end())
      throw InputError(m.file.path, photo.line, "a camera of the scene",
                       "\"" + photo.camera + "\"");
    if (progress) progress("reading " + photo.path, 0.0);
    const Image image = read_image(photo.path);
    const CameraDescription camera = camera_for(named->second, image);
    require_size(image, camera, photo.path);
    const auto beside = [&](const std::string& path) {
      if (path.empty()) return Image();
      Image other = read_image(path);
      require_size(other, camera, path);
      return other;
    };
    const Image mask = beside(photo.mask_path), variance = beside(photo.variance_path),
                standard_error = beside(photo.standard_error_path);
    const auto planes =
        photo.planes.empty() ? spectral_planes(image, m.scene(), photo.path) : photo.planes;
    for (const PlaneSource& source : planes) {
      PixelPlane pixels;
      pixels.value = &channel_of(image, source.channel, photo.path);
      if (!source.variance_channel.empty())
        pixels.variance = &channel_of(image, source.variance_channel, photo.path);
      else if (!photo.variance_path.empty())
        pixels.variance = &channel_of(variance, source.channel, photo.variance_path);
      if (!photo.standard_error_path.empty())
        pixels.standard_error =
            &channel_of(standard_error, source.channel, photo.standard_error_path);
      if (!photo.mask_path.empty()) pixels.mask = &mask.channels.front().samples;
      PlaneReadings plane;
      plane.name = source.name;
      plane.view = views.of(photo, camera, source.photosites);
      plane.band_weights = weights_of(source, m.scene(), m.file.path);
      plane.gain = hold_of(photo.gain.fit);
      plane.gain_value = photo.gain_value;
      plane.gain_relative_u = photo.gain.standard_uncertainty;
      PlaneCounts counts;
      counts.name = source.name;
      counts.pixels = image.pixel_count();
      add_readings(m, photo, plane.view, pixels, plane, counts);
      m.problem.planes.push_back(std::move(plane));
      m.counts.push_back(std::move(counts));
      m.size_px.emplace_back(image.width, image.height);
    }
  }
}

}  // namespace truebox

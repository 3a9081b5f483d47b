// SPDX-License-Identifier: BSD-3-Clause
#include "document/image_set.h"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

#include "difference/difference_map.h"
#include "document/codecs.h"
#include "image/half.h"
#include "image/spectral_image.h"
#include "radiometry/input_error.h"

namespace truebox {
namespace {

/// The channel that `difference_map` paired with this one.
const Channel& partner(const Image& image, const DifferenceChannel& channel) {
  if (channel.wavelength_nm > 0.0) {
    const SpectralChannels bands = spectral_channels(image);
    for (std::size_t i = 0; i < bands.indices.size(); ++i)
      if (std::abs(bands.wavelengths_nm[i] - channel.wavelength_nm) <=
          DifferenceOptions{}.wavelength_tolerance_nm)
        return image.channels[bands.indices[i]];
  } else if (const Channel* found = image.find(channel.name)) {
    return *found;
  }
  throw MismatchError("no partner for channel " + channel.name);
}

std::vector<ImageBand> bands_of(const DifferenceMap& map, const Observer* observer) {
  std::vector<ImageBand> bands;
  std::vector<double> centres_nm;
  for (const auto& channel : map.channels) {
    ImageBand band{channel.name, channel.wavelength_nm};
    for (std::size_t c = 0; c < 3; ++c)
      if (channel.name == std::string(1, "RGB"[c])) band.linear_rgb[c] = 1.0;
    if (channel.wavelength_nm > 0.0) centres_nm.push_back(channel.wavelength_nm);
    bands.push_back(std::move(band));
  }
  if (observer == nullptr || centres_nm.size() != bands.size() || bands.size() < 2) return bands;
  const auto weights = band_weights(WavelengthGrid::from_centres(centres_nm), *observer);
  for (std::size_t b = 0; b < bands.size(); ++b) bands[b].linear_rgb = linear_bt709(weights[b]);
  return bands;
}

template <typename Value>
std::vector<Value> every_nth(const std::vector<Value>& samples, int width, int height, int n) {
  if (n == 1) return samples;
  std::vector<Value> kept;
  for (int y = 0; y < height; y += n)
    for (int x = 0; x < width; x += n)
      kept.push_back(samples[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                             static_cast<std::size_t>(x)]);
  return kept;
}

detail::PackedPlane surface_plane(std::span<const int> surface_of_pixel, std::size_t surfaces) {
  detail::PackedPlane plane;
  for (int s : surface_of_pixel)
    plane.bits.push_back(
        s >= 0 && static_cast<std::size_t>(s) < surfaces ? static_cast<std::uint16_t>(s + 1) : 0);
  return plane;
}

void check_sides(const ImageSide& test, const ImageSide& reference,
                 const ImageSetOptions& options) {
  const std::size_t pixels = reference.image->pixel_count();
  for (const ImageSide* side : {&test, &reference})
    if (side->uncertainty != nullptr && side->uncertainty->pixel_count() != pixels)
      throw MismatchError("the uncertainty of '" + side->name + "' has another size");
  if (!options.surface_of_pixel.empty() && options.surface_of_pixel.size() != pixels)
    throw MismatchError("the surfaces are not those of the images' pixels");
  if (options.surfaces.size() > 65534)
    throw std::invalid_argument("more than 65534 surfaces in an image set");
}

}  // namespace

std::size_t ImageSet::planes_per_band() const {
  return 2u + (test_uncertainty != UncertaintyKind::none) +
         (reference_uncertainty != UncertaintyKind::none);
}

std::size_t ImageSet::plane_count() const {
  return bands.size() * planes_per_band() + !surfaces.empty();
}

ImageSet make_image_set(const ImageSide& test, const ImageSide& reference,
                        const ImageSetOptions& options) {
  const DifferenceMap map = difference_map(*test.image, *reference.image);
  check_sides(test, reference, options);
  ImageSet set;
  set.quantity = options.quantity;
  set.unit = map.unit;
  if (const auto unit = test.image->attributes.find("unit");
      set.unit.empty() && unit != test.image->attributes.end())
    set.unit = unit->second;
  set.test_name = test.name;
  set.reference_name = reference.name;
  if (test.uncertainty != nullptr) set.test_uncertainty = test.kind;
  if (reference.uncertainty != nullptr) set.reference_uncertainty = reference.kind;
  set.exposure = options.exposure;
  set.bands = bands_of(map, options.observer);
  if (!options.surface_of_pixel.empty()) set.surfaces = options.surfaces;

  std::vector<detail::PackedPlane> planes;
  for (const auto& channel : map.channels) {
    planes.push_back(detail::half_plane(partner(*test.image, channel).samples, false));
    planes.push_back(detail::half_plane(channel.reference, false));
    for (const ImageSide* side : {&test, &reference})
      if (side->uncertainty != nullptr)
        planes.push_back(detail::half_plane(partner(*side->uncertainty, channel).samples, true));
  }
  for (const auto& plane : planes) set.scale_exponents.push_back(plane.exponent);
  const std::size_t predicted = planes.size();
  if (!set.surfaces.empty())
    planes.push_back(surface_plane(options.surface_of_pixel, set.surfaces.size()));

  for (set.stride = 1;;) {
    std::vector<detail::PackedPlane> kept = planes;
    for (auto& plane : kept) plane.bits = every_nth(plane.bits, map.width, map.height, set.stride);
    set.width_px = (map.width + set.stride - 1) / set.stride;
    set.height_px = (map.height + set.stride - 1) / set.stride;
    set.packed = detail::deflate_planes(kept, set.planes_per_band(), predicted);
    if (set.packed.size() <= options.most_bytes || set.stride > map.width + map.height) return set;
    const double excess =
        static_cast<double>(set.packed.size()) / static_cast<double>(options.most_bytes);
    set.stride =
        std::max(set.stride + 1, static_cast<int>(std::floor(set.stride * std::sqrt(excess))));
  }
}

std::vector<float> unpack_plane(const ImageSet& set, std::size_t plane) {
  if (const std::string objection = image_set_objection(set); !objection.empty())
    throw std::invalid_argument(objection);
  if (plane >= set.plane_count()) throw std::invalid_argument("no such plane");
  const std::size_t pixels =
      static_cast<std::size_t>(set.width_px) * static_cast<std::size_t>(set.height_px);
  const auto bytes = detail::inflate_exactly(set.packed, pixels * set.plane_count() * 2);
  const std::size_t period = set.planes_per_band();
  const bool is_surface = plane >= set.scale_exponents.size();
  std::vector<float> samples(pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    std::uint16_t bits = 0;
    for (std::size_t p = is_surface ? plane : plane % period; p <= plane; p += period)
      bits = static_cast<std::uint16_t>(bits + (*bytes)[2 * p * pixels + i] +
                                        ((*bytes)[(2 * p + 1) * pixels + i] << 8));
    samples[i] = is_surface ? static_cast<float>(bits)
                            : std::ldexp(half_value(bits), set.scale_exponents[plane]);
  }
  return samples;
}

std::string image_set_objection(const ImageSet& set) {
  constexpr int kMostPixels = 1 << 16;
  constexpr std::size_t kMostSamples = std::size_t{1} << 28;
  if (set.width_px < 1 || set.height_px < 1 || set.width_px > kMostPixels ||
      set.height_px > kMostPixels || set.stride < 1 || set.bands.empty())
    return "an image set of an impossible size";
  const std::size_t pixels =
      static_cast<std::size_t>(set.width_px) * static_cast<std::size_t>(set.height_px);
  if (set.bands.size() > kMostSamples || set.plane_count() > kMostSamples / pixels)
    return "an image set of more than 2^28 samples";
  if (set.scale_exponents.size() != set.bands.size() * set.planes_per_band())
    return "an image set with other than one scale a plane";
  if (!detail::inflate_exactly(set.packed, pixels * set.plane_count() * 2))
    return fmt::format("an image set whose bytes are not {} planes of {} x {} samples",
                       set.plane_count(), set.width_px, set.height_px);
  return {};
}

}  // namespace truebox

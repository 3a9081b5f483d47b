// SPDX-License-Identifier: BSD-3-Clause
#include "colour/scene_linear.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <stdexcept>

#include "image/spectral_image.h"

namespace truebox {
namespace {

constexpr const char* kNames[] = {"R", "G", "B"};

float srgb_decoded(double v) {  // IEC 61966-2-1:1999, 5.2
  return static_cast<float>(v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
}

SceneLinear from_bands(const Image& image, const SpectralChannels& bands,
                       const Observer& observer) {
  Image spectral(image.width, image.height);
  for (std::size_t i : bands.indices) spectral.channels.push_back(image.channels[i]);
  add_display_channels(spectral, WavelengthGrid::from_centres(bands.wavelengths_nm), observer);
  SceneLinear result{
      Image(image.width, image.height),
      fmt::format("{} bands {:g} to {:g} nm, {}", bands.indices.size(),
                  bands.wavelengths_nm.front(), bands.wavelengths_nm.back(), observer.name)};
  for (const char* name : kNames) result.rgb.channels.push_back(*spectral.find(name));
  return result;
}

SceneLinear from_rgb(const Image& image) {
  SceneLinear result{Image(image.width, image.height), "R, G, B taken as linear BT.709"};
  const auto transfer = image.attributes.find("transfer"),
             white = image.attributes.find("white_dn");
  const bool coded = transfer != image.attributes.end() && transfer->second == "sRGB";
  const double top =
      coded && white != image.attributes.end() ? std::atof(white->second.c_str()) : 1.0;
  for (const char* name : kNames) result.rgb.channels.push_back(*image.find(name));
  if (!coded) return result;
  result.origin = "R, G, B decoded from sRGB";
  for (auto& channel : result.rgb.channels)
    for (float& v : channel.samples) v = srgb_decoded(v / top);
  return result;
}

}  // namespace

std::optional<SceneLinear> scene_linear(const Image& image, const Observer* observer) {
  const SpectralChannels bands = spectral_channels(image);
  if (bands.indices.size() > 1) {
    if (observer == nullptr) throw std::invalid_argument("spectral bands need an observer");
    return from_bands(image, bands, *observer);
  }
  if (image.find("R") != nullptr && image.find("G") != nullptr && image.find("B") != nullptr)
    return from_rgb(image);
  if (image.channels.size() != 1) return std::nullopt;
  SceneLinear result{Image(image.width, image.height),
                     fmt::format("channel {} as grey", image.channels[0].name)};
  for (const char* name : kNames) result.rgb.channels.push_back({name, image.channels[0].samples});
  return result;
}

}  // namespace truebox

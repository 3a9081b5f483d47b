// SPDX-License-Identifier: BSD-3-Clause
#include "image/spectral_image.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <numeric>
#include <stdexcept>

namespace truebox {

std::string spectral_channel_name(double wavelength_nm) {
  char text[64];
  std::snprintf(text, sizeof text, "S0.%.6fnm", wavelength_nm);
  std::string name = text;
  name[name.find('.', 3)] = ',';
  return name;
}

double spectral_channel_wavelength_nm(const std::string& name) {
  if (!name.starts_with("S0.") || !name.ends_with("nm")) return -1.0;
  std::string number = name.substr(3, name.size() - 5);
  std::replace(number.begin(), number.end(), ',', '.');
  if (number.empty() || number.find_first_not_of("0123456789.") != std::string::npos) return -1.0;
  return std::strtod(number.c_str(), nullptr);
}

SpectralChannels spectral_channels(const Image& image) {
  std::vector<std::pair<double, std::size_t>> found;
  for (std::size_t i = 0; i < image.channels.size(); ++i) {
    const double nm = spectral_channel_wavelength_nm(image.channels[i].name);
    if (nm > 0.0) found.emplace_back(nm, i);
  }
  std::sort(found.begin(), found.end());
  SpectralChannels result;
  for (const auto& [nm, index] : found) {
    result.indices.push_back(index);
    result.wavelengths_nm.push_back(nm);
  }
  return result;
}

void add_display_channels(Image& image, const WavelengthGrid& grid, const Observer& observer) {
  const SpectralChannels bands = spectral_channels(image);
  if (bands.indices.size() != grid.size())
    throw std::invalid_argument("the image has other bands than the grid");
  const auto weights = band_weights(grid, observer);
  std::vector<Channel> rgb(3);
  const char* names[] = {"R", "G", "B"};
  for (int c = 0; c < 3; ++c) rgb[c] = {names[c], std::vector<float>(image.pixel_count())};
  for (std::size_t pixel = 0; pixel < image.pixel_count(); ++pixel) {
    Tristimulus xyz;
    for (std::size_t b = 0; b < grid.size(); ++b) {
      const double value = image.channels[bands.indices[b]].samples[pixel];
      xyz.X += value * weights[b].X;
      xyz.Y += value * weights[b].Y;
      xyz.Z += value * weights[b].Z;
    }
    const LinearRgb linear = linear_bt709(xyz);
    for (int c = 0; c < 3; ++c) rgb[c].samples[pixel] = static_cast<float>(linear[c]);
  }
  for (auto& channel : rgb) image.channels.push_back(std::move(channel));
  image.attributes["spectralLayoutVersion"] = "1.0";
  image.attributes["emissiveUnits"] =
      "W.m^-2.sr^-1";  // the layout's own wording; "unit" says per nm
  image.attributes["colorInteropID"] = "lin_rec709_scene";
}

}  // namespace truebox

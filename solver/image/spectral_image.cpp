// SPDX-License-Identifier: BSD-3-Clause
#include "image/spectral_image.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
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
  static const std::map<std::string, double> kMetres = {
      {"nm", 1e-9}, {"um", 1e-6}, {"mm", 1e-3}, {"pm", 1e-12}, {"m", 1.0}};
  static const std::map<std::string, double> kHertz = {{"Hz", 1.0},  {"kHz", 1e3},  {"MHz", 1e6},
                                                       {"GHz", 1e9}, {"THz", 1e12}, {"PHz", 1e15}};
  constexpr double kSpeedOfLight_m_s = 299792458.0;
  if (!name.starts_with("S0.")) return -1.0;
  const std::size_t unit_at = name.find_last_of("0123456789,.") + 1;
  const std::string unit = name.substr(unit_at);
  std::string number = name.substr(3, unit_at - 3);
  std::replace(number.begin(), number.end(), ',', '.');
  if (number.empty() || number.find_first_not_of("0123456789.eE+-") != std::string::npos)
    return -1.0;
  char* end = nullptr;
  const double value = std::strtod(number.c_str(), &end);
  if (*end != '\0' || !(value > 0.0) || !std::isfinite(value)) return -1.0;
  if (unit == "nm") return value;  // the common case, without rounding
  if (const auto metres = kMetres.find(unit); metres != kMetres.end())
    return value * metres->second * 1e9;
  if (const auto hertz = kHertz.find(unit); hertz != kHertz.end())
    return kSpeedOfLight_m_s / (value * hertz->second) * 1e9;
  return -1.0;
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
  // R = G = B = 1 has integral(L ybar) = 1, which is 683 cd m^-2.
  image.attributes["whiteLuminance"] = "683";
}

}  // namespace truebox

// SPDX-License-Identifier: BSD-3-Clause
#include "export/parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "radiometry/input_error.h"

namespace truebox::exporting {

std::vector<Triangle> triangles_of(const Surface& surface) {
  std::vector<Triangle> triangles;
  const std::size_t fronts = surface.two_sided ? surface.pieces.size() / 2 : surface.pieces.size();
  for (std::size_t p = 0; p < fronts; ++p)
    for (std::size_t k = 2; k < surface.pieces[p].size(); ++k)
      triangles.push_back({surface.pieces[p][0], surface.pieces[p][k - 1], surface.pieces[p][k]});
  return triangles;
}

double Steps::at(double wavelength_nm) const {
  if (nm.empty() || wavelength_nm < nm.front() || wavelength_nm > nm.back()) return 0.0;
  const auto above = std::upper_bound(nm.begin(), nm.end(), wavelength_nm);
  if (above == nm.end()) return value.back();
  const auto k = static_cast<std::size_t>(above - nm.begin());
  const double t = (wavelength_nm - nm[k - 1]) / (nm[k] - nm[k - 1]);
  return (1.0 - t) * value[k - 1] + t * value[k];
}

std::array<double, 2> band_edges_nm(const WavelengthGrid& bands, std::size_t band) {
  const double centre = bands.centre_nm(band), half = 0.5 * bands.width_nm(band);
  return {band == 0 ? centre - half : 0.5 * (bands.centre_nm(band - 1) + centre),
          band + 1 == bands.size() ? centre + half : 0.5 * (centre + bands.centre_nm(band + 1))};
}

Steps stepped(const WavelengthGrid& bands, const std::vector<double>& values) {
  constexpr double kHalfFlank_nm = 0.005;
  Steps steps;
  for (std::size_t b = 0; b < bands.size(); ++b) {
    const auto [from, to] = band_edges_nm(bands, b);
    steps.nm.push_back(b == 0 ? from : from + kHalfFlank_nm);
    steps.nm.push_back(b + 1 == bands.size() ? to : to - kHalfFlank_nm);
    steps.value.insert(steps.value.end(), 2, values[b]);
  }
  return steps;
}

std::vector<double> emitted_radiance(const Material& material) {
  std::vector<double> radiance = material.exitance.values;
  for (double& v : radiance) v /= std::numbers::pi;
  return radiance;
}

std::vector<double> normal_reflectance(const Material& material) {
  if (material.refractive_index.values.empty()) return material.reflectance.values;
  std::vector<double> reflectance;
  for (std::size_t b = 0; b < material.refractive_index.values.size(); ++b) {
    const double n = material.refractive_index[b];
    const double k = material.absorption_index.values.empty() ? 0.0 : material.absorption_index[b];
    reflectance.push_back(((n - 1.0) * (n - 1.0) + k * k) / ((n + 1.0) * (n + 1.0) + k * k));
  }
  return reflectance;
}

double middle_index(const Material& material) {
  return material.refractive_index[material.refractive_index.values.size() / 2];
}

void refuse_material(const Scene& scene, const Material& material, const std::string& expected,
                     const std::string& found) {
  throw InputError(scene.path, 0, expected, "material \"" + material.name + "\": " + found);
}

double common_refractive_index(const Scene& scene, const Material& material, const char* program) {
  const auto& n = material.refractive_index.values;
  const auto [least, most] = std::minmax_element(n.begin(), n.end());
  if (*most - *least > 1e-9 * *most)
    refuse_material(scene, material,
                    fmt::format("one refractive index for all bands ({} knows no other)", program),
                    fmt::format("indices from {:g} to {:g}", *least, *most));
  return *least;
}

Colours::Colours(const Scene& scene, const ExportOptions& options, RgbFromXyz rgb_from_xyz)
    : scene_(&scene),
      options_(&options),
      rgb_from_xyz_(rgb_from_xyz),
      light_(scene.bands.size(), 0.0) {
  for (const Surface& surface : scene.surfaces) {
    double area_m2 = 0.0;
    for (const Polygon& piece : surface.pieces) area_m2 += area_vector(piece).norm();
    const Material& material = scene.material_of(surface);
    for (std::size_t b = 0; b < light_.size(); ++b) light_[b] += area_m2 * material.exitance[b];
  }
  if (std::all_of(light_.begin(), light_.end(), [](double v) { return v == 0.0; }))
    std::fill(light_.begin(), light_.end(), 1.0);  // no light: seen under equal energy
  if (!options.rgb_bands_nm) return;
  bands_.emplace();
  for (int c = 0; c < 3; ++c) {
    const double nm = (*options.rgb_bands_nm)[c];
    std::size_t best = 0;
    for (std::size_t b = 0; b < scene.bands.size(); ++b)
      if (std::abs(scene.bands.centre_nm(b) - nm) < std::abs(scene.bands.centre_nm(best) - nm))
        best = b;
    if (std::abs(scene.bands.centre_nm(best) - nm) > 0.01)
      throw InputError(
          scene.path, 0, fmt::format("one of the scene's band centres in nm"),
          fmt::format("{:g} nm (the nearest is {:g})", nm, scene.bands.centre_nm(best)));
    (*bands_)[static_cast<std::size_t>(c)] = best;
  }
}

LinearRgb Colours::rgb(const std::vector<double>& stimulus) const {
  if (bands_) return {stimulus[(*bands_)[0]], stimulus[(*bands_)[1]], stimulus[(*bands_)[2]]};
  return rgb_from_xyz_(tristimulus(stimulus, scene_->bands, options_->observer));
}

LinearRgb Colours::reflectance(const Material& material, std::vector<std::string>& notes) const {
  const std::vector<double> rho = normal_reflectance(material);
  if (bands_) return rgb(rho);
  std::vector<double> reflected = light_;
  for (std::size_t b = 0; b < reflected.size(); ++b) reflected[b] *= rho[b];
  const LinearRgb to = rgb(reflected), from = rgb(light_);
  LinearRgb ratio{};
  bool clamped = false;
  for (int c = 0; c < 3; ++c) {
    // Light outside the gamut has channels near or below zero, where a ratio means nothing.
    const double r = from[c] > 1e-3 * (from[0] + from[1] + from[2]) ? to[c] / from[c] : 0.0;
    ratio[c] = std::clamp(r, 0.0, 0.999);
    clamped |= ratio[c] != r;
  }
  if (clamped)
    notes.push_back(
        fmt::format("The colour of material \"{}\" lies outside the three colours and was clamped.",
                    material.name));
  return ratio;
}

LinearRgb Colours::radiance(const Material& material) const {
  return rgb(emitted_radiance(material));
}

std::string Colours::meaning() const {
  if (bands_)
    return fmt::format(
        "Red, green and blue carry the bands at {:g}, {:g} and {:g} nm: reflectances of these "
        "bands, radiances in W m^-2 sr^-1 nm^-1.",
        scene_->bands.centre_nm((*bands_)[0]), scene_->bands.centre_nm((*bands_)[1]),
        scene_->bands.centre_nm((*bands_)[2]));
  return "Reflectances are the colours of the surfaces under the scene's own light (" +
         options_->observer.name + "): exact for one reflection only.";
}

const CameraDescription* chosen_camera(const Scene& scene, const std::string& name) {
  if (name.empty() && scene.cameras.empty()) return nullptr;
  std::string known;
  for (const auto& [key, camera] : scene.cameras) {
    if (key == name || (name.empty() && scene.cameras.size() == 1)) return &camera;
    known += (known.empty() ? "" : ", ") + key;
  }
  throw InputError(scene.path, 0, "one of the cameras: " + (known.empty() ? "(none)" : known),
                   name.empty() ? "no camera chosen" : "\"" + name + "\"");
}

std::filesystem::path file_of(const std::filesystem::path& target,
                              const std::vector<std::string>& endings, const char* default_name) {
  const std::string ending = target.extension().string();
  if (std::find(endings.begin(), endings.end(), ending) != endings.end()) return target;
  static const std::vector<std::string> kOthers = {".xml", ".pbrt", ".rad",  ".obj", ".gltf",
                                                   ".glb", ".toml", ".json", ".exr", ".html"};
  if (std::find(kOthers.begin(), kOthers.end(), ending) != kOthers.end())
    throw InputError(target.string(), 0, "a folder, or a file ending in " + endings.front(),
                     ending);
  return target / default_name;
}

std::string safe_name(const std::string& name, std::size_t index) {
  std::string safe = fmt::format("s{:03}_", index);
  for (const char c : name.substr(0, 60)) {
    const bool plain = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                       c == '_' || c == '-';
    safe += plain ? c : '_';
  }
  return safe;
}

std::string xml_text(const std::string& text) {
  std::string out;
  for (const char c : text) switch (c) {
      case '&': out += "&amp;"; break;
      case '<': out += "&lt;"; break;
      case '>': out += "&gt;"; break;
      case '"': out += "&quot;"; break;
      default: out += static_cast<unsigned char>(c) < 0x20 || c == '-' ? ' ' : c;
    }
  return out;
}

std::string joined(const std::vector<double>& values, const char* separator) {
  std::string text;
  for (const double v : values) text += fmt::format("{}{:.9g}", text.empty() ? "" : separator, v);
  return text;
}

}  // namespace truebox::exporting

// SPDX-License-Identifier: BSD-3-Clause
// What the writers of this folder share. Internal to it.
#pragma once

#include "export/scene_export.h"

namespace truebox::exporting {

using Triangle = std::array<Vec3, 3>;

/// The lit fronts of a surface as triangles, right-hand normals; a two-sided surface's backs are
/// left out: programs are told "two-sided", coincident faces would fight.
std::vector<Triangle> triangles_of(const Surface& surface);

/// A spectrum as steps: constant in each band, over in 0.01 nm where two bands meet (half way
/// between their centres); piecewise linear through (nm, value).
struct Steps {
  std::vector<double> nm, value;
  double at(double wavelength_nm) const;  ///< 0 outside
};
Steps stepped(const WavelengthGrid& bands, const std::vector<double>& values);

/// Where band b begins and ends in `stepped`.
std::array<double, 2> band_edges_nm(const WavelengthGrid& bands, std::size_t band);

std::vector<double> emitted_radiance(const Material& material);  ///< M / pi

/// What a surface reflects of light along its normal, one value a band: its reflectance, or
/// Fresnel's from its optical constants.
std::vector<double> normal_reflectance(const Material& material);

/// Index of a dielectric in the middle band, for formats that hold one.
double middle_index(const Material& material);

/// The one refractive index of all bands. InputError that names `program`, which knows no other.
double common_refractive_index(const Scene& scene, const Material& material, const char* program);

/// InputError that says what `program` cannot hold: `expected` of the material instead of `found`.
[[noreturn]] void refuse_material(const Scene& scene, const Material& material,
                                  const std::string& expected, const std::string& found);

/// Three colours of a material: by bands exactly, or by colorimetry. Linear, not clamped.
/// Reflectances are ratios, reflected to incident, under the scene's own light: right for one
/// bounce; those of metals are along the normal.
class Colours {
 public:
  /// `rgb_from_xyz` turns tristimulus values into the format's RGB (white: equal energy or D65).
  using RgbFromXyz = LinearRgb (*)(const Tristimulus&);
  Colours(const Scene& scene, const ExportOptions& options, RgbFromXyz rgb_from_xyz);

  LinearRgb reflectance(const Material& material, std::vector<std::string>& notes) const;
  LinearRgb radiance(const Material& material) const;
  bool by_bands() const { return bands_.has_value(); }
  std::string meaning() const;  ///< a sentence for the file's head

 private:
  LinearRgb rgb(const std::vector<double>& stimulus) const;

  const Scene* scene_;
  const ExportOptions* options_;
  RgbFromXyz rgb_from_xyz_;
  std::optional<std::array<std::size_t, 3>> bands_;
  std::vector<double> light_;
};

/// The camera that `options` names, or the only one; nullptr if the scene has none.
const CameraDescription* chosen_camera(const Scene& scene, const std::string& name);

/// `target` if it ends in one of `endings`, else target / default_name. InputError on other
/// endings.
std::filesystem::path file_of(const std::filesystem::path& target,
                              const std::vector<std::string>& endings, const char* default_name);

/// Letters, digits, '_' and '-' of a name, anything else as '_'; `index` keeps names apart.
std::string safe_name(const std::string& name, std::size_t index);
std::string xml_text(const std::string& text);
std::string joined(const std::vector<double>& values, const char* separator);

ExportSummary write_mitsuba(const Scene&, const std::filesystem::path&, const ExportOptions&);
ExportSummary write_pbrt(const Scene&, const std::filesystem::path&, const ExportOptions&);
ExportSummary write_radiance(const Scene&, const std::filesystem::path&, const ExportOptions&);
ExportSummary write_obj(const Scene&, const std::filesystem::path&, const ExportOptions&);
ExportSummary write_gltf(const Scene&, const std::filesystem::path&, const ExportOptions&);

}  // namespace truebox::exporting

// SPDX-License-Identifier: BSD-3-Clause
// Wavefront OBJ with its MTL. The format has no units: lengths are m, Kd and Ke linear BT.709, Ke
// the radiance as `truebox render` writes it into R, G and B.
#include <fmt/format.h>

#include <cmath>

#include "export/parts.h"
#include "image/image_file.h"

namespace truebox::exporting {

namespace {

std::string line(const LinearRgb& rgb) {
  return fmt::format("{:.9g} {:.9g} {:.9g}", rgb[0], rgb[1], rgb[2]);
}

// Illumination models of the MTL specification: 1 matte, 3 mirror, 5 mirror with Fresnel's
// reflectance, 7 refraction too. Pr and Pm are a common extension; Pr^2 is GGX alpha.
std::string illumination(const Material& material) {
  switch (material.scattering) {
    case Scattering::lambertian: break;
    case Scattering::mirror:
      return material.refractive_index.values.empty() ? "illum 3\n" : "illum 5\n";
    case Scattering::rough_conductor:
      return fmt::format("Pr {:.9g}\nPm 1\nillum 5\n", std::sqrt(material.roughness));
    case Scattering::dielectric:
      return fmt::format("Tf 1 1 1\nNi {:.9g}\nillum 7\n", middle_index(material));
  }
  return "illum 1\n";
}

}  // namespace

ExportSummary write_obj(const Scene& scene, const std::filesystem::path& target,
                        const ExportOptions& options) {
  ExportSummary summary;
  const auto file = file_of(target, {".obj"}, "scene.obj");
  auto materials_file = file;
  materials_file.replace_extension(".mtl");
  const Colours colours(scene, options, &linear_bt709);
  std::string mtl = "# " + colours.meaning() + "\n";
  for (std::size_t m = 0; m < scene.materials.size(); ++m) {
    const Material& material = scene.materials[m];
    const LinearRgb shine = colours.radiance(material);
    const LinearRgb black{0.0, 0.0, 0.0}, white{1.0, 1.0, 1.0};
    const LinearRgb rho = material.scattering == Scattering::dielectric
                              ? white
                              : colours.reflectance(material, summary.notes);
    const bool is_matte = material.scattering == Scattering::lambertian;
    mtl += fmt::format("\nnewmtl {}\nKa 0 0 0\nKd {}\nKs {}\nKe {}\n{}",
                       safe_name(material.name, m), line(is_matte ? rho : black),
                       line(is_matte ? black : rho), line(shine), illumination(material));
    if (!is_matte)
      summary.notes.push_back("Material \"" + material.name +
                              "\" is described for looking at: what programs make of illum 3, 5 "
                              "and 7, Ni, Pr and Pm differs.");
  }
  std::string text = "# lengths in m; faces counter-clockwise seen from the lit side\nmtllib " +
                     materials_file.filename().string() + "\n";
  std::size_t first = 1;
  for (std::size_t s = 0; s < scene.surfaces.size(); ++s) {
    const Surface& surface = scene.surfaces[s];
    if (surface.is_opening) continue;
    const std::size_t fronts =
        surface.two_sided ? surface.pieces.size() / 2 : surface.pieces.size();
    text += fmt::format("o {}\nusemtl {}\n", safe_name(surface.name, s),
                        safe_name(scene.material_of(surface).name, surface.material));
    for (std::size_t p = 0; p < fronts; ++p) {
      std::string face = "f";
      for (const Vec3& v : surface.pieces[p]) {
        text += fmt::format("v {:.9g} {:.9g} {:.9g}\n", v.x(), v.y(), v.z());
        face += fmt::format(" {}", first++);
      }
      text += face + "\n";
    }
  }
  write_file_atomically(materials_file, mtl);
  write_file_atomically(file, text);
  summary.files = {file, materials_file};
  summary.notes.push_back(colours.meaning());
  summary.notes.push_back("OBJ holds neither cameras nor units.");
  return summary;
}

}  // namespace truebox::exporting

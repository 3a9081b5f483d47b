// SPDX-License-Identifier: BSD-3-Clause
// Wavefront OBJ with its MTL. The format has no units: lengths are m, Kd and Ke linear BT.709, Ke
// the radiance as `truebox render` writes it into R, G and B.
#include <fmt/format.h>

#include "export/parts.h"
#include "image/image_file.h"

namespace truebox::exporting {

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
    const LinearRgb rho = colours.reflectance(material, summary.notes);
    const LinearRgb shine = colours.radiance(material);
    mtl += fmt::format(
        "\nnewmtl {}\nKa 0 0 0\nKd {:.9g} {:.9g} {:.9g}\nKs 0 0 0\nKe {:.9g} {:.9g} {:.9g}\nillum "
        "1\n",
        safe_name(material.name, m), rho[0], rho[1], rho[2], shine[0], shine[1], shine[2]);
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

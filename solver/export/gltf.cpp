// SPDX-License-Identifier: BSD-3-Clause
// glTF 2.0. Base colours are linear BT.709; emission is a luminance per colour in cd m^-2
// (KHR_materials_emissive_strength): 683 lm/W times integral(L xbar..zbar). Where the colours carry
// bands, emission is their spectral radiance instead. No gloss: KHR_materials_specular 0.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "export/gltf_model.h"
#include "export/parts.h"
#include "image/image_file.h"

namespace truebox::exporting {
namespace {

GltfMaterial material_of(const Scene& scene, const Surface& surface, const Colours& colours,
                         std::vector<std::string>& notes) {
  const Material& material = scene.material_of(surface);
  const bool is_clear = material.scattering == Scattering::dielectric;
  GltfMaterial written{material.name,
                       is_clear ? LinearRgb{1.0, 1.0, 1.0} : colours.reflectance(material, notes),
                       colours.radiance(material), surface.two_sided};
  if (is_clear) {
    written.refractive_index = middle_index(material);
    written.roughness = 0.0;
  } else if (material.scattering != Scattering::lambertian) {
    written.metallic = 1.0;
    written.roughness = std::sqrt(material.roughness);
  }
  if (material.scattering != Scattering::lambertian)
    notes.push_back("Material \"" + material.name +
                    "\" follows glTF's rules: Schlick's reflectance instead of Fresnel's (a mirror "
                    "grows brighter at grazing angles), one refractive index, that of the middle "
                    "band.");
  const double efficacy = colours.by_bands() ? 1.0 : 683.0;
  for (double& e : written.emission) e = std::max(0.0, efficacy * e);
  return written;
}

}  // namespace

ExportSummary write_gltf(const Scene& scene, const std::filesystem::path& target,
                         const ExportOptions& options) {
  ExportSummary summary;
  const auto file = file_of(target, {".gltf", ".glb"}, "scene.glb");
  const Colours colours(scene, options, &linear_bt709);
  const std::string unit =
      colours.by_bands() ? "W m^-2 sr^-1 nm^-1 of the three bands" : "cd m^-2 (683 lm/W)";
  GltfModel model;
  model.extras = {{"source", std::filesystem::path(scene.path).filename().string()},
                  {"lengths", "m"},
                  {"colours", colours.meaning()},
                  {"emission", unit}};
  std::map<std::pair<std::size_t, bool>, std::size_t> material_at;
  for (std::size_t s = 0; s < scene.surfaces.size(); ++s) {
    const Surface& surface = scene.surfaces[s];
    if (surface.is_opening) continue;
    GltfMesh mesh;
    mesh.name = surface.name;
    GltfAttribute positions{"POSITION", 3, {}}, normals{"NORMAL", 3, {}};
    for (const Triangle& t : triangles_of(surface)) {
      const Vec3 normal = (t[1] - t[0]).cross(t[2] - t[0]).normalized();
      for (const Vec3& v : t) {
        mesh.triangles.push_back(static_cast<std::uint32_t>(mesh.triangles.size()));
        for (int c = 0; c < 3; ++c) {
          positions.values.push_back(static_cast<float>(v[c]));
          normals.values.push_back(static_cast<float>(normal[c]));
        }
      }
    }
    mesh.attributes = {std::move(positions), std::move(normals)};
    const auto [at, is_new] =
        material_at.insert({{surface.material, surface.two_sided}, model.materials.size()});
    mesh.material = at->second;
    if (is_new) model.materials.push_back(material_of(scene, surface, colours, summary.notes));
    model.meshes.push_back(std::move(mesh));
  }
  for (const auto& [name, camera] : scene.cameras) model.cameras.emplace_back(name, camera);
  if (file.extension() == ".glb") {
    write_file_atomically(file, glb_bytes(model));
  } else {
    auto binary_file = file;
    binary_file.replace_extension(".bin");
    const GltfFile written = gltf_file(model, binary_file.filename().string());
    write_file_atomically(binary_file, written.binary);
    write_file_atomically(file, written.json + "\n");
    summary.files.push_back(binary_file);
  }
  summary.files.insert(summary.files.begin(), file);
  summary.notes.push_back(colours.meaning());
  summary.notes.push_back("Emission is in " + unit + ".");
  summary.notes.push_back(
      "Backs are marked as not drawn; a renderer that ignores the mark reflects from both sides. "
      "One "
      "that ignores KHR_materials_specular adds gloss: switch it off there.");
  return summary;
}

}  // namespace truebox::exporting

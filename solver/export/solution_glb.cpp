// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "export/gltf_model.h"
#include "export/solution_files.h"
#include "export/solution_surface.h"

namespace truebox {
namespace {

std::string attribute_name(const char* quantity, double nm) {
  std::string name = fmt::format("_{}_{:.3f}NM", quantity, nm);
  name[name.find('.')] = '_';
  return name;
}

// Linear BT.709 of the radiance B / pi, three numbers a vertex.
std::vector<double> vertex_colours(const SolutionSurface& surface, const WavelengthGrid& bands,
                                   const Observer& observer) {
  const auto weights = band_weights(bands, observer);
  std::vector<double> colours;
  for (Eigen::Index v = 0; v < surface.radiosity.rows(); ++v) {
    Tristimulus xyz;
    for (std::size_t b = 0; b < bands.size(); ++b) {
      const double radiance = surface.radiosity(v, static_cast<Eigen::Index>(b)) / std::numbers::pi;
      xyz.X += radiance * weights[b].X;
      xyz.Y += radiance * weights[b].Y;
      xyz.Z += radiance * weights[b].Z;
    }
    const LinearRgb rgb = linear_bt709(xyz);
    colours.insert(colours.end(), rgb.begin(), rgb.end());
  }
  return colours;
}

}  // namespace

std::string solution_glb(const Prediction& prediction, const Observer& observer) {
  const Scene& scene = prediction.scene();
  const SolutionSurface surface = solution_surface(prediction);
  const std::vector<double> colours = vertex_colours(surface, scene.bands, observer);
  std::vector<std::vector<std::uint32_t>> triangles(scene.surfaces.size());
  double brightest = 0.0;
  for (std::size_t t = 0; t < surface.surface.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t v = surface.triangles[3 * t + static_cast<std::size_t>(k)];
      triangles[surface.surface[t]].push_back(v);
      if (!scene.material_of(scene.surfaces[surface.surface[t]]).emits())
        for (int c = 0; c < 3; ++c) brightest = std::max(brightest, colours[3 * v + c]);
    }
  const double exposure = brightest > 0.0 ? 1.0 / brightest : 1.0;

  exporting::GltfModel model;
  model.extras = {
      {"lengths", "m"},
      {"COLOR_0",
       fmt::format("{:.9g} x linear BT.709 of the radiance B / pi, clamped to 0..1", exposure)},
      {"_RADIOSITY", scene.exitance_unit()},
      {"_ERROR_BOUND", std::string(scene.exitance_unit()) + ", of the radiosity at the vertex"}};
  model.materials = {{"solution", {1.0, 1.0, 1.0}, {0.0, 0.0, 0.0}, false, true}};
  for (std::size_t s = 0; s < triangles.size(); ++s) {
    if (triangles[s].empty()) continue;
    std::vector<std::uint32_t> used = triangles[s];
    std::sort(used.begin(), used.end());
    used.erase(std::unique(used.begin(), used.end()), used.end());
    exporting::GltfMesh mesh;
    mesh.name = scene.surfaces[s].name;
    for (const std::uint32_t v : triangles[s])
      mesh.triangles.push_back(
          static_cast<std::uint32_t>(std::lower_bound(used.begin(), used.end(), v) - used.begin()));
    exporting::GltfAttribute positions{"POSITION", 3, {}}, colour{"COLOR_0", 3, {}};
    for (const std::uint32_t v : used)
      for (int c = 0; c < 3; ++c) {
        positions.values.push_back(static_cast<float>(surface.positions_m[v][c]));
        colour.values.push_back(
            static_cast<float>(std::clamp(exposure * colours[3 * v + c], 0.0, 1.0)));
      }
    mesh.attributes = {std::move(positions), std::move(colour)};
    const auto add_bands = [&](const char* quantity, const BandMatrix& values) {
      for (std::size_t b = 0; b < scene.bands.size(); ++b) {
        exporting::GltfAttribute attribute{
            attribute_name(quantity, scene.bands.centre_nm(b)), 1, {}};
        for (const std::uint32_t v : used)
          attribute.values.push_back(static_cast<float>(
              values(static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(b))));
        mesh.attributes.push_back(std::move(attribute));
      }
    };
    add_bands("RADIOSITY", surface.radiosity);
    add_bands("ERROR_BOUND", surface.error_bound);
    model.meshes.push_back(std::move(mesh));
  }
  for (const auto& [name, camera] : scene.cameras) model.cameras.emplace_back(name, camera);
  return exporting::glb_bytes(model);
}

}  // namespace truebox

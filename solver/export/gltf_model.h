// SPDX-License-Identifier: BSD-3-Clause
// A glTF 2.0 asset before it is written. Internal to this folder.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "scene/scene.h"

namespace truebox::exporting {

struct GltfAttribute {
  std::string name;  ///< "POSITION", "COLOR_0"; the application's own begin with "_"
  int components = 1;
  std::vector<float> values;
};

struct GltfMesh {
  std::string name;
  std::vector<GltfAttribute> attributes;  ///< POSITION first
  std::vector<std::uint32_t> triangles;
  std::size_t material = 0;
};

struct GltfMaterial {
  std::string name;
  std::array<double, 3> base_colour = {1.0, 1.0, 1.0};
  std::array<double, 3> emission = {0.0, 0.0, 0.0};  ///< any size: written as factor x strength
  bool two_sided = false;
  bool unlit = false;
  double metallic = 0.0;          ///< 1: base colour is the reflectance along the normal
  double roughness = 1.0;         ///< its square is GGX alpha
  double refractive_index = 0.0;  ///< above 0: a clear dielectric with a volume behind it
};

/// Meshes in world coordinates, m; y need not be up. Extras are notes for a person.
struct GltfModel {
  std::vector<GltfMesh> meshes;
  std::vector<GltfMaterial> materials;
  std::vector<std::pair<std::string, CameraDescription>> cameras;
  std::vector<std::pair<std::string, std::string>> extras;
};

struct GltfFile {
  std::string json, binary;
};

/// Source: glTF 2.0 specification (Khronos 2021), KHR_materials_unlit, _specular,
/// _emissive_strength, _transmission, _ior, _volume. `buffer_uri` is empty for the binary form.
GltfFile gltf_file(const GltfModel& model, const std::string& buffer_uri);
std::string glb_bytes(const GltfModel& model);

}  // namespace truebox::exporting

// SPDX-License-Identifier: BSD-3-Clause
#include "export/gltf_model.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <set>

namespace truebox::exporting {
namespace {

using nlohmann::json;
static_assert(std::endian::native == std::endian::little, "glTF buffers are little-endian");

constexpr int kFloat = 5126, kUnsignedInt = 5125, kArrayBuffer = 34962, kElementArrayBuffer = 34963;

// Appends bytes as a view of their own; every element is 4 bytes wide, so views stay aligned.
template <class T>
int add_view(json& root, std::string& binary, const std::vector<T>& values, int target) {
  const std::size_t bytes = values.size() * sizeof(T);
  root["bufferViews"].push_back(
      {{"buffer", 0}, {"byteOffset", binary.size()}, {"byteLength", bytes}, {"target", target}});
  binary.append(reinterpret_cast<const char*>(values.data()), bytes);
  return static_cast<int>(root["bufferViews"].size()) - 1;
}

std::size_t add_attribute(json& root, std::string& binary, const GltfAttribute& attribute) {
  static const char* const kTypes[] = {"", "SCALAR", "VEC2", "VEC3", "VEC4"};
  const auto n = static_cast<std::size_t>(attribute.components);
  json accessor = {{"bufferView", add_view(root, binary, attribute.values, kArrayBuffer)},
                   {"componentType", kFloat},
                   {"count", attribute.values.size() / n},
                   {"type", kTypes[n]}};
  std::vector<float> low(n, INFINITY), high(n, -INFINITY);
  for (std::size_t i = 0; i < attribute.values.size(); ++i) {
    low[i % n] = std::min(low[i % n], attribute.values[i]);
    high[i % n] = std::max(high[i % n], attribute.values[i]);
  }
  accessor["min"] = low;
  accessor["max"] = high;
  root["accessors"].push_back(std::move(accessor));
  return root["accessors"].size() - 1;
}

json material_json(const GltfMaterial& m, std::set<std::string>& extensions) {
  json material = {{"name", m.name},
                   {"doubleSided", m.two_sided},
                   {"pbrMetallicRoughness",
                    {{"baseColorFactor", {m.base_colour[0], m.base_colour[1], m.base_colour[2], 1}},
                     {"metallicFactor", m.metallic},
                     {"roughnessFactor", m.roughness}}}};
  if (m.unlit) {
    material["extensions"]["KHR_materials_unlit"] = json::object();
    extensions.insert("KHR_materials_unlit");
    return material;
  }
  const auto extend = [&](const char* name, const json& value) {
    material["extensions"][name] = value;
    extensions.insert(name);
  };
  if (m.refractive_index > 0.0) {
    extend("KHR_materials_ior", {{"ior", m.refractive_index}});
    extend("KHR_materials_transmission", {{"transmissionFactor", 1}});
    extend("KHR_materials_volume", {{"thicknessFactor", 1}});  // any: without one it is a thin wall
  } else if (m.metallic == 0.0) {
    // glTF's default dielectric has a Fresnel highlight; Lambertian surfaces have none.
    extend("KHR_materials_specular", {{"specularFactor", 0}});
  }
  const double strength = *std::max_element(m.emission.begin(), m.emission.end());
  if (strength > 0.0) {
    json factor = json::array();
    for (const double e : m.emission) factor.push_back(std::clamp(e / strength, 0.0, 1.0));
    material["emissiveFactor"] = factor;
    extend("KHR_materials_emissive_strength", {{"emissiveStrength", strength}});
  }
  return material;
}

// glTF cameras look along -z with y up.
json camera_node(const std::string& name, const CameraDescription& c, std::size_t index) {
  const Vec3 back = -c.direction.normalized();
  const Vec3 right = c.up.cross(back).normalized(), up = back.cross(right);
  json matrix = json::array();
  for (const Vec3& column : {right, up, back})
    for (const double v : {column.x(), column.y(), column.z(), 0.0}) matrix.push_back(v);
  for (const double v : {c.position_m.x(), c.position_m.y(), c.position_m.z(), 1.0})
    matrix.push_back(v);
  return {{"name", name}, {"camera", index}, {"matrix", matrix}};
}

void append_word(std::string& bytes, std::size_t value) {
  const auto word = static_cast<std::uint32_t>(value);
  char four[4];
  std::memcpy(four, &word, 4);
  bytes.append(four, 4);
}

}  // namespace

GltfFile gltf_file(const GltfModel& model, const std::string& buffer_uri) {
  GltfFile file;
  json root = {{"asset", {{"version", "2.0"}, {"generator", "truebox"}}}, {"scene", 0}};
  for (const auto& [key, value] : model.extras) root["asset"]["extras"][key] = value;
  json nodes = json::array();
  std::set<std::string> extensions;
  for (const GltfMaterial& m : model.materials)
    root["materials"].push_back(material_json(m, extensions));
  for (const GltfMesh& mesh : model.meshes) {
    json primitive = {{"mode", 4}, {"material", mesh.material}};
    for (const GltfAttribute& attribute : mesh.attributes)
      primitive["attributes"][attribute.name] = add_attribute(root, file.binary, attribute);
    root["accessors"].push_back(
        {{"bufferView", add_view(root, file.binary, mesh.triangles, kElementArrayBuffer)},
         {"componentType", kUnsignedInt},
         {"count", mesh.triangles.size()},
         {"type", "SCALAR"}});
    primitive["indices"] = root["accessors"].size() - 1;
    nodes.push_back({{"name", mesh.name}, {"mesh", root["meshes"].size()}});
    root["meshes"].push_back({{"name", mesh.name}, {"primitives", {primitive}}});
  }
  for (const auto& [name, c] : model.cameras) {
    const double half_height = 0.5 * c.film_m[1] / c.focal_length_m;
    nodes.push_back(camera_node(name, c, root["cameras"].size()));
    root["cameras"].push_back({{"name", name},
                               {"type", "perspective"},
                               {"perspective",
                                {{"yfov", 2.0 * std::atan(half_height)},
                                 {"aspectRatio", c.film_m[0] / c.film_m[1]},
                                 {"znear", 1e-3}}}});
  }
  json all = json::array();
  for (std::size_t n = 0; n < nodes.size(); ++n) all.push_back(n);
  root["scenes"] = {{{"nodes", all}}};
  root["nodes"] = std::move(nodes);
  if (!extensions.empty()) root["extensionsUsed"] = extensions;
  json buffer = {{"byteLength", file.binary.size()}};
  if (!buffer_uri.empty()) buffer["uri"] = buffer_uri;
  root["buffers"] = {buffer};
  file.json = root.dump(buffer_uri.empty() ? -1 : 1, ' ', false, json::error_handler_t::replace);
  return file;
}

// 12-byte header, then a JSON chunk filled up with spaces and a BIN chunk with zeros.
std::string glb_bytes(const GltfModel& model) {
  GltfFile file = gltf_file(model, "");
  file.json.append((4 - file.json.size() % 4) % 4, ' ');
  file.binary.append((4 - file.binary.size() % 4) % 4, '\0');
  std::string bytes = "glTF";
  append_word(bytes, 2);
  append_word(bytes, 12 + 8 + file.json.size() + 8 + file.binary.size());
  append_word(bytes, file.json.size());
  bytes += "JSON" + file.json;
  append_word(bytes, file.binary.size());
  bytes.append("BIN\0", 4);
  return bytes + file.binary;
}

}  // namespace truebox::exporting

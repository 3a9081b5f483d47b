// SPDX-License-Identifier: BSD-3-Clause
#include "solver/export/glb_reader.h"

#include <cmath>
#include <cstring>
#include <map>
#include <stdexcept>

namespace truebox {
namespace {

void require(bool holds, const std::string& rule) {
  if (!holds) throw std::runtime_error("glTF: " + rule);
}

std::uint32_t word(const std::string& bytes, std::size_t at) {
  require(at + 4 <= bytes.size(), "a word within the file");
  std::uint32_t value = 0;
  std::memcpy(&value, bytes.data() + at, 4);
  return value;
}

std::size_t components(const nlohmann::json& accessor) {
  static const std::map<std::string, std::size_t> kCount = {
      {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}};
  return kCount.at(accessor.at("type"));
}

template <class T>
std::vector<T> values(const Glb& glb, std::size_t index) {
  const auto& accessor = glb.json.at("accessors").at(index);
  const auto& view = glb.json.at("bufferViews").at(accessor.at("bufferView").get<std::size_t>());
  std::vector<T> result(accessor.at("count").get<std::size_t>() * components(accessor));
  require(result.size() * sizeof(T) <= view.at("byteLength").get<std::size_t>(),
          "an accessor fits its view");
  std::memcpy(result.data(), glb.binary.data() + view.at("byteOffset").get<std::size_t>(),
              result.size() * sizeof(T));
  return result;
}

void check_accessors(const Glb& glb) {
  for (const auto& view : glb.json.at("bufferViews")) {
    require(view.at("byteOffset").get<std::size_t>() % 4 == 0, "views are aligned to 4 bytes");
    require(view.at("byteOffset").get<std::size_t>() + view.at("byteLength").get<std::size_t>() <=
                glb.binary.size(),
            "views lie in the buffer");
    require(view.at("byteLength").get<std::size_t>() > 0, "views are not empty");
  }
  for (std::size_t a = 0; a < glb.json.at("accessors").size(); ++a) {
    const auto& accessor = glb.json.at("accessors")[a];
    if (accessor.at("componentType") != 5126) continue;
    const std::vector<float> v = glb.floats(a);
    for (std::size_t i = 0; i < v.size(); ++i) {
      const std::size_t c = i % components(accessor);
      require(std::isfinite(v[i]), "accessors hold finite numbers");
      require(v[i] >= accessor.at("min").at(c).get<float>() &&
                  v[i] <= accessor.at("max").at(c).get<float>(),
              "min and max bound an accessor");
    }
  }
}

void check_meshes(const Glb& glb) {
  for (const auto& mesh : glb.json.at("meshes"))
    for (const auto& primitive : mesh.at("primitives")) {
      const auto& attributes = primitive.at("attributes");
      const auto count = [&](std::size_t accessor) {
        return glb.json.at("accessors").at(accessor).at("count").get<std::size_t>();
      };
      const std::size_t vertices = count(attributes.at("POSITION"));
      for (const auto& [name, accessor] : attributes.items()) {
        require(count(accessor) == vertices, "attributes are equally long");
        require(name[0] == '_' || name == "POSITION" || name == "NORMAL" || name == "COLOR_0",
                "application attributes begin with _");
      }
      for (const std::uint32_t i : glb.indices(primitive.at("indices")))
        require(i < vertices, "indices lie in the mesh");
      require(count(primitive.at("indices")) % 3 == 0, "triangles have three corners");
      require(primitive.at("material").get<std::size_t>() < glb.json.at("materials").size(),
              "materials exist");
    }
}

}  // namespace

std::vector<float> Glb::floats(std::size_t accessor) const {
  return values<float>(*this, accessor);
}

std::vector<std::uint32_t> Glb::indices(std::size_t accessor) const {
  return values<std::uint32_t>(*this, accessor);
}

Glb read_glb(const std::string& bytes) {
  require(bytes.starts_with("glTF") && word(bytes, 4) == 2, "magic and version");
  require(word(bytes, 8) == bytes.size(), "the header's length is the file's");
  const std::size_t json_size = word(bytes, 12);
  require(bytes.substr(16, 4) == "JSON" && json_size % 4 == 0, "first chunk JSON, 4-byte aligned");
  const std::size_t binary_size = word(bytes, 20 + json_size);
  require(bytes.substr(24 + json_size, 4) == std::string("BIN\0", 4) && binary_size % 4 == 0,
          "second chunk BIN, 4-byte aligned");
  require(28 + json_size + binary_size == bytes.size(), "nothing after the chunks");
  Glb glb{nlohmann::json::parse(bytes.substr(20, json_size)), bytes.substr(28 + json_size)};
  require(glb.json.at("asset").at("version") == "2.0", "asset version");
  const auto length = glb.json.at("buffers").at(0).at("byteLength").get<std::size_t>();
  require(length <= binary_size && binary_size - length < 4, "the buffer is the BIN chunk");
  check_accessors(glb);
  check_meshes(glb);
  return glb;
}

}  // namespace truebox

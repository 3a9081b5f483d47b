// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace truebox {

/// A binary glTF 2.0 file taken apart. `read_glb` holds it against the specification's rules for
/// chunks, buffers and accessors (Khronos 2021, sections 3.6, 3.7 and 4.4) and throws
/// std::runtime_error with the rule that is broken.
struct Glb {
  nlohmann::json json;
  std::string binary;

  std::vector<float> floats(std::size_t accessor) const;
  std::vector<std::uint32_t> indices(std::size_t accessor) const;
};
Glb read_glb(const std::string& bytes);

}  // namespace truebox

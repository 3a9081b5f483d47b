// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace truebox {

/// A scene of a wanted size for tests of scale, made of nothing but numbers.
struct GeneratedSceneOptions {
  std::string kind = "museum";  ///< one of generated_scene_kinds()
  std::size_t patches = 50000;  ///< elements that `solve --elements` is to be asked for
  std::uint64_t seed = 1;       ///< places, sizes and colours of what stands in the rooms

  std::string invalid() const;  ///< why these options cannot be used; empty if they can
};

std::vector<std::string> generated_scene_kinds();

/// A scene file (TOML, m, three bands), closed. About 40 patches a surface, so that three nested
/// grids resolve each: the size grows by rooms, not by finer elements.
///   museum   rooms of 10 m x 10 m x 5 m in a square grid, doors between neighbours, a skylight in
///            each ceiling, four eight-sided columns, four pedestals and two exhibits a room
///   factory  a row of halls 30 m x 18 m x 8 m with gates between, four strips of skylight in each
///            roof, six eight-sided columns and eight machines of two blocks each; two offices with
///            a lamp each beside every hall
/// The same options give the same text. std::invalid_argument if options.invalid().
std::string generated_scene(const GeneratedSceneOptions& options);

}  // namespace truebox

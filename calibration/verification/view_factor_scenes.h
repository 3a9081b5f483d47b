// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "scene/scene.h"

namespace truebox {

/// A flat outline of a scene file. Outlines of one name are parts of one surface.
struct SceneOutline {
  std::string name;
  Polygon outline;
  std::vector<Polygon> holes;
};

/// A row of view_factors.csv as a scene: "A1", "A2", and a "blocker" in some.
struct CertifiedScene {
  std::string name;
  std::vector<SceneOutline> outlines;
  double view_factor = 0.0;  ///< from A1 to A2
  /// What the scene's flat shapes may be off from the row's: round shapes are polygons of
  /// `corners` corners, an element is a small square.
  double relative_model_error = 0.0;
};

/// Black surfaces in one band; outlines of one name follow each other.
Scene scene_of(const std::vector<SceneOutline>& outlines);

/// Every row of reference_dir/analytic/view_factors.csv. InputError as read_table.
std::vector<CertifiedScene> view_factor_scenes(const std::filesystem::path& reference_dir,
                                               int corners = 128);

}  // namespace truebox

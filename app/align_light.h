// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "align_render.h"
#include "alignment/photometric_refinement.h"
#include "document/report.h"

namespace truebox::app {

struct LightArguments {
  bool wanted = false;
  std::string gains = "band";   ///< or "surface"
  std::string mask;             ///< image, 0 where a pixel does not count
  std::size_t elements = 3000;  ///< of the prediction, where no render is given
};

/// Refines the camera by the light between the edges: of the render, or, of a scene, of a
/// prediction solved and rendered from where the edges put the camera.
PhotometricRefinement refine_by_light(const LightArguments& arguments,
                                      const AlignmentSubject& subject, const BoxAlignment& edges,
                                      const Image& photograph, const Progress& progress);

nlohmann::json light_json(const PhotometricRefinement& light);
Section light_section(const PhotometricRefinement& light);
Check light_check(const PhotometricRefinement& light);
void print_light(const PhotometricRefinement& light);

}  // namespace truebox::app

// SPDX-License-Identifier: BSD-3-Clause
// Where predicted edges come from. Internal to this folder.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "alignment/camera_parameters.h"
#include "alignment/scene_edges.h"

namespace truebox {

/// Edges that a photograph should show: of a scene's polygons, or of a rendered picture.
class EdgeSource {
 public:
  virtual ~EdgeSource() = default;
  /// Where a camera sees them.
  virtual std::vector<EdgeSample> visible(const CameraParameters& parameters,
                                          const EdgeSampling& sampling) const = 0;
  /// What lies on both sides: "floor/left wall".
  virtual std::string border_name(const EdgeSample& sample) const = 0;
  virtual Vec3 centre_m() const = 0;
  virtual std::string what() const = 0;  ///< "box", "picture": for messages
};

/// Of a scene, possibly stretched; `like` has film and pixels.
std::unique_ptr<EdgeSource> edges_of_scene(const Scene& scene, const CameraDescription& like);

/// Of a rendered picture: the steps of its light, shadows' edges among them, where its AOVs say.
/// Visibility is that of the render's camera: for photographs from nearby. `like` as above.
class RenderedView;
std::unique_ptr<EdgeSource> edges_of_picture(const RenderedView& view,
                                             const CameraDescription& like);

}  // namespace truebox

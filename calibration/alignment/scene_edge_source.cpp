// SPDX-License-Identifier: BSD-3-Clause
#include "alignment/edge_source.h"

namespace truebox {
namespace {

class OfScene : public EdgeSource {
 public:
  OfScene(const Scene& scene, const CameraDescription& like)
      : scene_(scene), like_(like), edges_(scene) {}

  std::vector<EdgeSample> visible(const CameraParameters& p,
                                  const EdgeSampling& sampling) const override {
    const Camera camera(camera_description(p, like_));
    if (p.stretch == std::array{1.0, 1.0, 1.0}) return edges_.visible(camera, sampling);
    const SceneEdges moved(
        with_moved_vertices(scene_, [&](const Vec3& v) { return stretched(p, v); }));
    auto found = moved.visible(camera, sampling);
    const Vec3 s(p.stretch[0], p.stretch[1], p.stretch[2]);
    for (EdgeSample& sample : found)
      sample.point_m = p.centre_m + (sample.point_m - p.centre_m).cwiseQuotient(s);
    return found;
  }

  std::string border_name(const EdgeSample& sample) const override {
    return edges_.border_name(sample);
  }
  Vec3 centre_m() const override { return edges_.centre_m(); }
  std::string what() const override { return "box"; }

 private:
  const Scene& scene_;
  CameraDescription like_;
  SceneEdges edges_;
};

}  // namespace

std::unique_ptr<EdgeSource> edges_of_scene(const Scene& scene, const CameraDescription& like) {
  return std::make_unique<OfScene>(scene, like);
}

}  // namespace truebox

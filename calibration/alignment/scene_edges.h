// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "rays/triangle_rays.h"
#include "scene/scene.h"
#include "sensor/camera.h"

namespace truebox {

/// A straight line between two corners of the scene's polygons, m.
struct SceneEdge {
  Vec3 from_m = Vec3::Zero(), to_m = Vec3::Zero();
  std::vector<std::size_t> surfaces;  ///< that have it in their outline
};

/// A place on an edge as the camera sees it.
struct EdgeSample {
  std::size_t edge = 0;
  Vec3 point_m = Vec3::Zero();
  PixelPosition position;
  std::array<double, 2> normal{};    ///< unit, in the picture, from side 0 to side 1
  double half_length_px = 0.0;       ///< of the piece of edge that it stands for
  std::array<int, 2> sides{-1, -1};  ///< surfaces on both sides, -1: nothing
};

struct EdgeSampling {
  double spacing_px = 12.0;
  double probe_px = 1.5;      ///< how far on each side a ray asks which surface is seen
  double margin_px = 0.0;     ///< also beyond the film's border by this much
  double clearance_px = 0.0;  ///< samples that have another edge as close as this are left out
};

/// The edges of a scene and what hides them. Lines that several outlines share are one edge;
/// openings have none.
class SceneEdges {
 public:
  explicit SceneEdges(const Scene& scene);

  /// Where edges are seen: geometry edges, silhouettes and material borders alike are the places
  /// where the rays on both sides of a polygon's edge meet different surfaces, the nearer of them
  /// at the edge's own distance.
  std::vector<EdgeSample> visible(const Camera& camera, const EdgeSampling& sampling) const;

  const std::vector<SceneEdge>& edges() const { return edges_; }
  std::string surface_name(int surface) const;  ///< "nothing" for -1
  /// "floor/left wall": the two surfaces that a sample lies between, in alphabetical order.
  std::string border_name(const EdgeSample& sample) const;
  double diagonal_m() const { return diagonal_m_; }
  Vec3 centre_m() const { return centre_m_; }  ///< of the bounding box

 private:
  struct Probe {
    int surface = -1;
    double distance_m = 0.0;
  };
  Probe probe(const Camera& camera, PixelPosition position) const;
  void sample(std::size_t edge, const Camera& camera, const EdgeSampling& sampling,
              std::vector<EdgeSample>& samples) const;

  std::vector<SceneEdge> edges_;
  std::vector<std::string> names_;
  std::unique_ptr<TriangleRays> rays_;
  double diagonal_m_ = 0.0;
  Vec3 centre_m_ = Vec3::Zero();
};

/// Leaves out samples that another edge comes close to: a window there would see two steps. Of
/// edges that coincide, the first is kept.
std::vector<EdgeSample> cleared(const std::vector<EdgeSample>& samples, double clearance_px);

/// The scene with every vertex moved by `place` (for example stretched).
template <class Place>
Scene with_moved_vertices(Scene scene, const Place& place) {
  for (Surface& surface : scene.surfaces)
    for (Polygon& piece : surface.pieces)
      for (Vec3& vertex : piece) vertex = place(vertex);
  return scene;
}

}  // namespace truebox
